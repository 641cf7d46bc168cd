"""Session of the commands that drive a finger."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import ikns
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.live.publish import Publisher, Publishers
    from ikns.live.session import RunWriter


def software() -> dict[str, str]:
    """Return the versions that a result may depend on."""
    names = ("numpy", "numba", "pin")
    return {
        "ikns": ikns.__version__,
        "python": sys.version.split()[0],
        **{name: version(name) for name in names},
    }


@contextmanager
def live_session(
    folder: Path,
    calibrated: ikns.Subject,
    subject: Path,
    configuration: dict[str, Any],
    *,
    rate: float,
    participant: str | None,
    resume: bool,
    losses: list[str],
) -> Iterator[RunWriter]:
    """Open the next run of a session: a new one or, with `resume`, an existing one.

    A new one is of the participant, 01 if none is given.
    A run without a frame is removed, and so is its session if it was begun with it: a
    start that failed does not stand in the way of the next one. What is missing on disk
    in the end is added to `losses`, a sentence per file.
    """
    from ikns.calibration.subject_files import FILES
    from ikns.live.session import (
        create_session,
        discard_run,
        mend_session,
        next_run,
        open_run,
        session_lock,
    )

    about = {
        name: (subject / name).read_text("utf-8")
        for name in FILES
        if (subject / name).is_file()
    }
    if not resume:
        create_session(folder, participant=participant or "01")
    writer = None
    with session_lock(folder):
        if resume:
            for sentence in mend_session(folder):
                say(sentence)
        _, number = next_run(folder)
        try:
            with open_run(
                folder,
                labels=calibrated.skeleton.marker_set.labels,
                joint_names=calibrated.skeleton.joint_names,
                rate=rate,
                n_dof=calibrated.null_space_map.n_dof,
                configuration=configuration,
                subject=about,
                on_fault=say,
            ) as writer:
                yield writer
        except BaseException:
            for sentence in [] if writer is None else writer.losses:
                say(sentence)
            raise
        finally:
            if writer is None or not writer.rows("markers"):
                discard_run(folder, number, whole=not resume)
            else:
                losses += writer.losses


def check_participant(session: Path, participant: str | None) -> None:
    """Refuse the session of another participant."""
    from ikns.live.session import next_run

    whose, _ = next_run(session)
    if participant not in (None, whose):
        raise InvalidInput(
            f"{session}: this is the session of participant {whose}, not of "
            f"{participant}; give another folder."
        )


@contextmanager
def publishing(
    addresses: Sequence[str],
    subject: ikns.Subject | None,
    *,
    rate: float,
    simulated: bool,
    timeline: Timeline | None = None,
) -> Iterator[Publishers | None]:
    """Publish at addresses and to Rerun; None where nothing is asked for.

    Without a subject, events only.
    """
    if not addresses and timeline is None:
        yield None
        return
    from ikns.live.publish import Publishers, joint_places, open_publisher

    joints = {} if subject is None else joint_places(subject.skeleton, subject.chain)
    with ExitStack() as stack:
        opened = [
            stack.enter_context(
                open_publisher(
                    address,
                    rate=rate,
                    n_dof=0 if subject is None else subject.null_space_map.n_dof,
                    joints=joints,
                    simulated=simulated,
                    on_fault=say,
                )
            )
            for address in addresses
        ]
        if timeline is not None:
            title = "live, simulated" if simulated else "live"
            opened.append(stack.enter_context(_timeline(timeline, subject, title)))
        yield Publishers(opened)


class Timeline(NamedTuple):
    """Where a live loop is logged for Rerun: a file, or a viewer where it is None."""

    file: Path | None


def timeline_of(
    *,
    rerun: bool,
    rrd: Path | None,
    force: bool | None = None,
    inputs: Iterable[Path | None] = (),
) -> Timeline | None:
    """Check the options ``--rerun`` and ``--rrd``, before anything is opened.

    `force` is None where the command has no such option.
    """
    if not rerun and rrd is None:
        return None
    from ikns.view.timeline.rerun import check_rrd, load_rerun

    if rerun and rrd is not None:
        raise InvalidInput("expected --rerun or --rrd, found both.")
    if rrd is not None:
        check_rrd(rrd, force=force, inputs=inputs)
    load_rerun()
    return Timeline(rrd)


def _timeline(where: Timeline, subject: ikns.Subject | None, title: str) -> Publisher:
    from ikns.live.publish import Publisher
    from ikns.view.timeline import RerunLog, RerunSink

    log = RerunLog(where.file, title=title)
    sink = RerunSink(log, None if subject is None else subject.skeleton)
    return Publisher("rerun", sink, on_fault=say)


def say_undriven(n_dof: int, dofs: Sequence[int]) -> None:
    """Say which freedoms of a map no finger follows, if there are any."""
    from ikns.nullspace.signal_names import signal_names

    names = signal_names(n_dof)
    idle = [k for k in range(1, n_dof + 1) if k not in dofs]
    if idle:
        which = ", ".join(names[k - 1] for k in idle)
        sys.stderr.write(
            f"ikns: no finger follows {which}; one does with --finger "
            f"'sim:dof={idle[0]}' or 'dynamixel:PORT?dof={idle[0]}'.\n"
        )


def written(addresses: Sequence[str]) -> str | list[str] | None:
    """Return addresses of fingers as a session keeps them: one as it is, or a list."""
    if len(addresses) > 1:
        return list(addresses)
    return addresses[0] if addresses else None


def say(sentence: str) -> None:
    """Print a sentence on a new line of stderr, if it is still there."""
    with suppress(OSError):
        sys.stderr.write(f"\nikns: {sentence}\n")
