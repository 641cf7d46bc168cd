"""``ikns run``: from live markers to a finger, with everything recorded."""

from __future__ import annotations

import math
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import ikns
from ikns.calibration.subject_files import check_subject_folder
from ikns.cli.live_session import (
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
from ikns.cli.output import show, table
from ikns.cli.reading import label_names
from ikns.cli.stop_notice import STOPPED, arm_hint, watch_stops
from ikns.endings import signal_exit_code, stop_on_signals
from ikns.errors import DataLoss, InvalidInput

if TYPE_CHECKING:
    from ikns.live.publish import Publishers
    from ikns.live.runtime import AxisStatus, LoopStatus, Report
    from ikns.live.session.writer import RunWriter

#: Interval of the status line on the terminal, s.
_LINE_EVERY = 0.2


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
        str, typer.Option(help="Participant's code: letters and digits.")
    ] = "01",
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

    Exits with 3 when it ran but the finger never moved, or ended in its safe state.
    Without --finger a simulated finger moves. Whatever stops one of several fingers
    stops all.

    Research software, not a medical device.
    """
    _check_options(subject, duration, session, resume=resume)
    _check_machine(publish or [], realtime=realtime)

    from ikns.calibration.simulated import is_simulated, played_files
    from ikns.finger import Safety, open_fingers
    from ikns.live.control.settings import ControlSettings
    from ikns.live.runtime import run as drive
    from ikns.live.stream import open_source

    timeline = timeline_of(rerun=rerun, rrd=rrd)
    calibrated = ikns.Subject.load(subject)
    calibrated.readout(method)  # before a source or a finger is opened
    names = label_names(rename, labels)
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
        told = _once(lambda: say_undriven(n_dof, group.dofs))  # with all connected
        shown = [told, stack.enter_context(_status_line(arm))]
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
            on_status=_each(shown),
            status_every=1 / 30 if view else _LINE_EVERY,
            on_notice=say,
            listener=publisher,
            realtime=realtime,
        )
        told()  # it may have been too short for a status
    session = _kept(report, writer, session)
    title = f"{source} to {'nothing (dry run)' if dry_run else ' and '.join(addresses)}"
    _show_report(report, title, session, losses, publisher, as_json=as_json)
    _exit(report, losses)


def _check_options(
    subject: Path, duration: float | None, session: Path | None, *, resume: bool
) -> None:
    if duration is not None and not 0 < duration < math.inf:
        raise InvalidInput(f"expected a duration above 0 s, found {duration:g}.")
    if resume and session is None:
        raise InvalidInput("--resume needs the --session to continue.")
    check_subject_folder(subject)


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


def _show_report(
    report: Report,
    title: str,
    session: Path | None,
    losses: list[str],
    publisher: Publishers | None,
    *,
    as_json: bool,
) -> None:
    """Print how a run went."""
    from ikns.live.runtime.report import frames

    published = None if publisher is None else publisher.counts
    result = _result(report) | {
        "session": session,
        "losses": losses,
        "published": published,
    }
    show(
        result,
        table(
            title,
            {"quantity": "s", "value": "s"},
            _rows(report, published),
        ),
        *(
            f"{c.time:9.3f} s  {c.before} to {c.after}: {c.reason}"
            for c in report.transitions[-12:]
        ),
        *(f"{frames(n)}: {why}" for why, n in _most(report.rejections)),
        *([f"Wrote {session}"] if session else []),
        as_json=as_json,
    )


def _exit(report: Report, losses: list[str]) -> None:
    """Say what must not be missed, and exit with its code."""
    if losses:
        raise DataLoss("; ".join(losses))
    if report.stopped or report.problem:
        say(report.problem)
        raise typer.Exit(STOPPED)
    if code := signal_exit_code():
        raise typer.Exit(code)


def _most(rejections: dict[str, int]) -> list[tuple[str, int]]:
    """Return the most frequent reasons."""
    return list(rejections.items())[:12]


@contextmanager
def _status_line(arm: threading.Event) -> Iterator[Callable[[LoopStatus], None]]:
    """Rewrite one line on stderr if it is a terminal; a key arms what is stopped."""
    with watch_stops(arm.set, announce=False) as watch:
        if not sys.stderr.isatty():
            yield watch
            return
        last = -math.inf

        def write(status: LoopStatus) -> None:
            nonlocal last
            watch(status)
            if status.time - last >= _LINE_EVERY:
                last = status.time
                # A wrapped line could not be rewritten.
                room = shutil.get_terminal_size().columns - 1
                sys.stderr.write(f"\r\x1b[K{_line(status)[:room]}")
                sys.stderr.flush()

        yield write
        sys.stderr.write("\n")


def _each(shown: list[Callable[[LoopStatus], None]]) -> Callable[[LoopStatus], None]:
    def show(status: LoopStatus) -> None:
        for one in shown:
            one(status)

    return show


def _once(call: Callable[[], None]) -> Callable[..., None]:
    """Return what does something the first time that it is called."""
    left = [call]

    def tell(*_: LoopStatus) -> None:
        while left:
            left.pop()()

    return tell


def _line(s: LoopStatus) -> str:
    """Return the status, most important first: a narrow terminal cuts the rest."""
    # The reason stands above, where it does not vanish.
    state = f"STOPPED{arm_hint()}:" if s.stopped else f"{s.state:<7}"
    drive = f"{state} {' '.join(_axis(axis, s.axes) for axis in s.axes)}"
    late = 1e3 * s.latency
    # Never wider, so that 80 columns hold the residual too.
    pace = f"{s.rate:4.0f}/s p99 {late:4.{2 if late < 9.995 else 0}f} ms"
    if s.rejection:
        return f"{drive} {s.rejection} {pace} misses {s.misses}"
    place = "inside" if s.inside else "OUTSIDE"
    return (
        f"{drive} {pace} {place:<7} residual {1e3 * s.residual:4.1f} mm "
        f"c +-{s.uncertainty:5.3f} worst {1e3 * s.worst_residual:3.0f} mm "
        f"misses {s.misses}"
    )


def _axis(axis: AxisStatus, axes: tuple[AxisStatus, ...]) -> str:
    if len(axes) == 1 and axis.dof == 1:
        return f"c {axis.c:5.2f} flexion {axis.flexion:4.2f} ({axis.measured:4.2f})"
    # Two fit into 80 columns: c, flexion, measured.
    return f"c_{axis.dof} {axis.c:5.2f} {axis.flexion:4.2f} ({axis.measured:4.2f})"


def _result(report: Report) -> dict[str, Any]:
    return {
        "frames": report.frames,
        "seconds": report.seconds,
        "deadline_misses": report.misses,
        "latency_s": {
            name: {
                "p50": times.percentile(50),
                "p99": times.percentile(99),
                "p999": times.percentile(99.9),
                "worst": times.percentile(100),
            }
            for name, times in report.stages.items()
        },
        "source": report.source,
        "problem": report.problem,
        "rejections": report.rejections,
        "notices": report.notices,
        "transitions": [change._asdict() for change in report.transitions],
        "lost_rows": report.lost_rows,
    }


def _rows(report: Report, published: dict[str, Any] | None) -> list[list[str]]:
    total = report.stages["total"]
    counted = report.source
    return [
        ["frames", str(report.frames)],
        ["seconds", f"{report.seconds:.1f}"],
        ["frames rejected", str(sum(report.rejections.values()))],
        [
            "dropped, late, repeated, out of order",
            ", ".join(
                str(counted[name])
                for name in ("dropped", "late", "repeated", "out_of_order")
            ),
        ],
        [
            "receipt to command, p50 / p99 / worst ms",
            " / ".join(f"{1e3 * total.percentile(p):.2f}" for p in (50, 99, 100)),
        ],
        ["frames that took longer than a frame period", str(report.misses)],
        ["rows missing on disk", str(report.lost_rows)],
        *(
            [["published / dropped", "{sent} / {dropped}".format(**published)]]
            if published
            else []
        ),
    ]
