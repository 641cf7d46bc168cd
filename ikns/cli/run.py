"""``ikns run``: from live markers to a finger, with everything recorded."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import ikns
from ikns.calibration.subject_files import check_subject_folder
from ikns.cli.live_session import (
    check_participant,
    live_session,
    publishing,
    say,
    say_undriven,
    software,
    timeline_of,
    written,
)
from ikns.cli.options import (
    AnyMethod,
    AsJson,
    Fingers,
    LabelFile,
    Publish,
    Rename,
    Rerun,
    Rrd,
    SubjectFolder,
)
from ikns.cli.reading import label_names
from ikns.cli.run_report import show_report
from ikns.cli.run_status import LINE_EVERY, each, once, status_line
from ikns.cli.stop_notice import STOPPED
from ikns.endings import signal_exit_code, stop_on_signals
from ikns.errors import DataLoss, InvalidInput

if TYPE_CHECKING:
    from ikns.live.runtime import LoopStatus, Report
    from ikns.live.session.writer import RunWriter


def run(
    subject: SubjectFolder,
    source: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="replay:FILE, lsl:NAME, qualisys:HOST, vicon:HOST, "
            "natnet:HOST (OptiTrack), or ros2:TOPIC.",
        ),
    ],
    rename: Rename = None,
    labels: LabelFile = None,
    finger: Fingers = None,
    session: Annotated[
        Path | None, typer.Option(help="Folder to record everything in.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Add a run to a session that exists.")
    ] = False,
    participant: Annotated[
        str | None,
        typer.Option(
            help="Participant's code for --session: letters and digits.",
            show_default="01",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            help="Length of the run, s. Default: until Ctrl-C.", min=0.0, max=86400.0
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Do everything but move the finger.")
    ] = False,
    safe_state: Annotated[
        Literal["limp", "hold", "open"],
        typer.Option(
            help="State of the finger when poses stop arriving. Releasing a held "
            "object may itself be a hazard."
        ),
    ] = "limp",
    hold_speed: Annotated[
        float | None,
        typer.Option(
            help="Hold the finger while the hand is faster than this, m/s.",
            min=0.0,
            max=100.0,
        ),
    ] = None,
    max_uncertainty: Annotated[
        float,
        typer.Option(
            help="Hold the finger while the standard deviation of c is larger, "
            "as it is when markers that c needs are hidden.",
            min=0.0,
            max=10.0,
        ),
    ] = 0.025,
    method: AnyMethod = "paper",
    publish: Publish = None,
    rerun: Rerun = False,
    rrd: Rrd = None,
    view: Annotated[
        bool, typer.Option("--view", help="Show the body live in a browser.")
    ] = False,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime", help="Run the control loop at real-time priority, if allowed."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Drive a finger with the null space of a person's arm. Ctrl-C stops it.

    Exits with 3 when the finger was never active, or ended in its safe state.
    Without --finger a simulated finger moves. Whatever stops one of several fingers
    stops all.

    Research software, not a medical device.
    """
    _check_options(subject, session, participant, resume=resume)
    _check_machine(publish or [], realtime=realtime)

    from ikns.calibration.simulated import is_simulated, played_files
    from ikns.finger import Safety, open_fingers
    from ikns.live.control.settings import ControlSettings
    from ikns.live.runtime import run as drive
    from ikns.live.stream import open_source

    timeline = timeline_of(rerun=rerun, rrd=rrd)
    calibrated = ikns.Subject.load(subject)
    calibrated.readout(method)  # before a source or a finger is opened
    names = label_names(rename, labels, source)
    n_dof, addresses = calibrated.null_space_map.n_dof, finger or ["sim:"]
    group = open_fingers(addresses, n_dof=n_dof, safety=Safety(safe_state=safe_state))
    settings = ControlSettings(
        hold_speed=hold_speed,
        method=method,
        max_uncertainty=max_uncertainty,
        dofs=group.dofs,
    )
    with ExitStack() as stack:
        opened = open_source(source, subject=calibrated, names=names)
        stream, losses = stack.enter_context(opened), list[str]()
        simulated = is_simulated(calibrated, subject, played_files(source))
        shared = publishing(
            publish or [],
            calibrated,
            rate=stream.rate * stream.speed,
            simulated=simulated,
            timeline=timeline,
        )
        publisher = stack.enter_context(shared)
        ikns.warm_up()
        stop = stack.enter_context(stop_on_signals())
        started = {
            "source": source,
            "source_labels": list(stream.labels),
            "renamed": names,
            "finger": None if dry_run else written(addresses),
            "safe_state": safe_state,
            "publish": publish,
            "settings": settings.table(),
        }
        log = _recorded(
            session,
            calibrated,
            subject,
            started,
            rate=stream.rate,
            participant=participant,
            resume=resume,
            losses=losses,
        )
        writer = stack.enter_context(log)
        arm = threading.Event()
        told = once(lambda: say_undriven(n_dof, group.dofs))  # with all connected
        shown = [told, stack.enter_context(status_line(arm))]
        if view:
            shown.append(_body(stack, calibrated, subject, simulated, group.dofs))
        report = drive(
            stream,
            calibrated,
            None if dry_run else group,
            settings=settings,
            session=writer,
            duration=math.inf if duration is None else duration,
            stop=stop,
            arm=arm,
            on_status=each(shown),
            status_every=1 / 30 if view else LINE_EVERY,
            on_notice=say,
            listener=publisher,
            realtime=realtime,
        )
        told()  # it may have been too short for a status
    session = _kept(report, writer, session)
    title = f"{source} to {'nothing (dry run)' if dry_run else ' and '.join(addresses)}"
    show_report(report, title, session, losses, publisher, as_json=as_json)
    _exit(report, losses)


def _check_options(
    subject: Path,
    session: Path | None,
    participant: str | None,
    *,
    resume: bool,
) -> None:
    if resume and session is None:
        raise InvalidInput("--resume needs the --session to continue.")
    if participant is not None and session is None:
        raise InvalidInput("--participant needs the --session that names them.")
    check_subject_folder(subject)
    if resume and session is not None:
        check_participant(session, participant)


def _check_machine(publish: list[str], *, realtime: bool) -> None:
    """Refuse addresses and priorities that this machine does not have."""
    from ikns.live.publish import check_publish
    from ikns.live.runtime import check_realtime

    if realtime:
        check_realtime()
    for address in publish:
        check_publish(address)


def _recorded(
    session: Path | None,
    calibrated: ikns.Subject,
    subject: Path,
    started: dict[str, Any],
    **options: Any,
) -> AbstractContextManager[RunWriter | None]:
    """Open the session, if there is one; options as of :func:`live_session`."""
    if session is None:
        return nullcontext()
    return live_session(session, calibrated, subject, software() | started, **options)


def _kept(
    report: Report, writer: RunWriter | None, session: Path | None
) -> Path | None:
    """Count what is lost, and return the session if there is one."""
    if writer is None:
        return None
    report.lost_rows = writer.lost  # counted on disk once it is closed
    if report.frames:
        return session
    sys.stderr.write("ikns: no frame arrived, so no session was kept.\n")
    return None


def _body(
    stack: ExitStack,
    calibrated: ikns.Subject,
    subject: Path,
    simulated: bool,
    dofs: tuple[int, ...],
) -> Callable[[LoopStatus], None]:
    """Open the window with the body, and return what draws it."""
    from ikns.view.scene import body_view

    name = subject.resolve().name
    shown = body_view(calibrated, simulated=simulated, name=name, dofs=dofs)
    window, take = stack.enter_context(shown)
    sys.stderr.write(f"ikns: the view is at {window.url} on this machine.\n")
    window.open()
    return take


def _exit(report: Report, losses: list[str]) -> None:
    """Say what must not be missed, and exit with its code."""
    if losses:
        raise DataLoss("; ".join(losses))
    if report.stopped or report.problem:
        say(report.problem)
        raise typer.Exit(STOPPED)
    if code := signal_exit_code():
        raise typer.Exit(code)
