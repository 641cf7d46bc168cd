"""A recording on Rerun's timeline, for ``ikns view --rerun`` and ``--rrd``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import ikns
from ikns.cli.live_session import timeline_of
from ikns.cli.output import progress, show, table
from ikns.cli.reading import check_inputs
from ikns.errors import InvalidInput, naming

if TYPE_CHECKING:
    from ikns.nullspace.readout import Method


def view_in_rerun(
    read: Callable[[Path], ikns.Recording],
    subject: Path,
    recording: Path | None,
    rrd: Path | None,
    *,
    alone: bool,
    rerun: bool,
    method: Method,
    force: bool,
    as_json: bool,
) -> None:
    """Track a recording, log it, and print how much that was.

    `alone` is whether no page and no picture was asked for.
    """
    if recording is None or not alone:
        raise InvalidInput(
            "--rerun and --rrd show a recording, and no page or picture with it; "
            "leave out --out, --png, --animation, --open and --point."
        )
    timeline_of(rerun=rerun, rrd=rrd, force=force, inputs=[subject, recording])
    check_inputs([recording], subject)

    from ikns.calibration.simulated import is_simulated
    from ikns.live.control.recorded import recorded_signal
    from ikns.motion.unseen import warn_unseen
    from ikns.view.timeline import RerunLog, log_recording

    person = ikns.Subject.load(subject)
    with naming(str(subject)):
        person.readout(method)  # before anything is tracked
    simulated = is_simulated(person, subject, [recording])
    frames, body = read(recording), person.skeleton
    warn_unseen(body, frames, person.chain)
    with progress() as report:
        motion = ikns.MarkerIK(body).track(
            frames, chain=person.chain, progress=partial(report, recording.name)
        )
    c = recorded_signal(person, motion, recording=frames, method=method).raw
    title = f"{recording.name}, {subject.resolve().name}"
    title += " (simulated)" * simulated
    log = RerunLog(rrd, title=title, force=force)
    count = log_recording(log, body, motion, frames, c)
    log.close()
    remarks = tell_faults(person, frames)
    shown = {
        "subject": subject,
        "recording": recording,
        "simulated": simulated,
        "method": method,
        "rrd": rrd,
        "frames": count,
        "notes": remarks,
    }
    show(
        shown,
        table(title, {"quantity": "s", "value": "s"}, [["frames", str(count)]]),
        "In Rerun's viewer" if rrd is None else f"Wrote {rrd}",
        as_json=as_json,
    )


def tell_faults(person: ikns.Subject, frames: ikns.Recording) -> list[str]:
    """Say what is wrong with a recording, which is shown all the same."""
    from ikns.calibration.judged_motion import known_findings

    found = known_findings(
        person.skeleton,
        frames,
        chain=person.chain,
        measured=person.measured,
        report=person.report,
    )
    faults = [fault.sentence for fault in found if fault.severity != "note"]
    for fault in faults:
        sys.stderr.write(f"ikns: note: {fault}\n")
    return faults
