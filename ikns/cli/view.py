"""``ikns view``: a subject's map, and a recording, in three dimensions."""

from __future__ import annotations

import sys
import webbrowser
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import ikns
from ikns.cli.options import (
    MARKER_FILES,
    AnyMethod,
    AsJson,
    Force,
    From,
    Rerun,
    Rrd,
    To,
)
from ikns.cli.output import progress, show, table
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.cli.view_in_rerun import tell_faults, view_in_rerun
from ikns.errors import InvalidInput, naming
from ikns.output.file import refuse_overwriting, write_bytes, write_text

if TYPE_CHECKING:
    from ikns.nullspace.readout import Method
    from ikns.view.scene import Scene
    from ikns.view.scene.picture import ScenePicture


#: Endings of the page.
_PAGES = (".html", ".htm")
#: Of the table.
_COLUMNS = {"quantity": "s", "value": "s"}


@reads_markers
def view(
    read: Read,
    subject: Annotated[
        Path, typer.Argument(help="Folder that `ikns calibrate` wrote.")
    ],
    recording: Annotated[
        Path | None,
        typer.Argument(help=f"Recording to play: {MARKER_FILES}."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="HTML file to write.", show_default="view.html"),
    ] = None,
    png: Annotated[
        Path | None, typer.Option(help="Also write a picture, .png.")
    ] = None,
    animation: Annotated[
        Path | None,
        typer.Option(help="Also write an animation of up to 20 s, .gif or .png."),
    ] = None,
    point: Annotated[
        int | None,
        typer.Option(
            help="PCA point, counted from 1, at which the arm shows its null "
            "space. Default: the one with the widest range."
        ),
    ] = None,
    method: AnyMethod = "paper",
    open_page: Annotated[
        bool, typer.Option("--open", help="Show the page in the browser.")
    ] = False,
    rerun: Rerun = False,
    rrd: Rrd = None,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Show PCA points, volume and null space around the body, in one HTML file.

    With a recording, the page plays it with the map and the c that --method reads, with
    gaps where `ikns control` leaves it empty. A recording that `ikns check` rejects is
    played too, with what is wrong. --rerun and --rrd show it on a timeline
    instead, with every marker, c and the residuals.
    """
    inputs = [subject, recording]
    if rerun or rrd is not None:
        view_in_rerun(
            partial(read, start=from_, end=to),
            subject,
            recording,
            rrd,
            alone=(out, png, animation, point) == (None,) * 4 and not open_page,
            rerun=rerun,
            method=method,
            force=force,
            as_json=as_json,
        )
        return
    out = Path("view.html") if out is None else out
    pictures = [path for path in (png, animation) if path is not None]
    _check_files(out, png, animation, inputs, force=force)
    if recording is None:
        _check_without_recording((from_, to), method)
    check_inputs([recording], subject)

    from ikns.calibration.simulated import is_simulated

    person = ikns.Subject.load(subject)
    with naming(str(subject)):
        person.readout(method)  # before anything is tracked
    learned, row = person.null_space_map, None if point is None else point - 1
    simulated = is_simulated(person, subject, [] if recording is None else [recording])
    name = subject.resolve().name
    frames = None if recording is None else read(recording, start=from_, end=to)

    from ikns.view.scene import scene_html, scene_picture

    scene = _scene(
        person,
        frames,
        simulated=simulated,
        title=f"Null-space map of {name}"
        if recording is None
        else f"{recording.name}, {name}",
        point=row,
        method=method,
    )
    page = scene_html(scene)
    picture = None if png is None else scene_picture(scene)
    moving = (
        None
        if animation is None
        else _animation(scene, person, animation, held=recording is None)
    )
    write_text(out, page, force=force)
    remarks = [] if frames is None else tell_faults(person, frames)
    if png is not None and picture is not None:
        remarks += _write_picture(png, picture, force=force)
    if animation is not None and moving is not None:
        write_bytes(animation, moving, force=force)
    if open_page:
        webbrowser.open(out.resolve().as_uri())
    given = 0 if frames is None else len(frames.time)
    size = len(page.encode())
    result = {
        "subject": subject,
        "recording": recording,
        "simulated": simulated,
        "method": method,
        "html": out,
        "png": png,
        "animation": animation,
        "points": len(learned.centers_),
        "frames_of_the_recording": given,
        "frames_played": len(scene.times),
        "seconds": _seconds(scene),
        "page_bytes": size,
        "notes": remarks,
    }
    rows = _rows(scene, points=len(learned.centers_), given=given, size=size)
    name = scene.title + (" (simulated)" if simulated else "")
    written = f"Wrote {' and '.join(map(str, (out, *pictures)))}"
    show(result, table(name, _COLUMNS, rows), written, as_json=as_json)


def _check_files(
    out: Path,
    png: Path | None,
    animation: Path | None,
    inputs: list[Path | None],
    *,
    force: bool,
) -> None:
    """Refuse files that exist, that are the same, or whose endings are wrong."""
    allowed = ((out, _PAGES), (png, [".png"]), (animation, [".gif", ".png"]))
    files = [path for path, _ in allowed if path is not None]
    for path, endings in allowed:
        if path is not None:
            refuse_overwriting(path, force=force, inputs=inputs, endings=endings)
    if len({path.resolve() for path in files}) < len(files):
        raise InvalidInput(
            f"{files[-1]}: expected different files for each picture and for "
            "the page, found the same one twice."
        )


def _check_without_recording(part: tuple[str | None, ...], method: Method) -> None:
    if part != (None, None):
        raise InvalidInput("--from and --to need a recording.")
    if method != "paper":
        raise InvalidInput(
            f"--method {method} needs a recording to compute c from; without one, the "
            "map is the paper's."
        )


def _write_picture(path: Path, picture: ScenePicture, *, force: bool) -> list[str]:
    """Write a picture; return what there is to say of it, which is on stderr too."""
    write_bytes(path, picture.png, force=force)
    if picture.note:
        sys.stderr.write(f"ikns: {picture.note}.\n")
    return [picture.note] if picture.note else []


def _animation(scene: Scene, person: ikns.Subject, path: Path, *, held: bool) -> bytes:
    """Draw the moving picture of a map's self-motion, or of a recording."""
    from ikns.view.animation import FORMATS, animation_bytes

    return animation_bytes(
        scene,
        person.skeleton,
        person.chain,
        caption="The elbow swivels with the hand held; the finger bends with c."
        if held
        else "The finger bends with c.",
        format=FORMATS[path.suffix.lower()],
    )


def _scene(
    person: ikns.Subject,
    frames: ikns.Recording | None,
    *,
    simulated: bool,
    title: str,
    point: int | None,
    method: Method,
) -> Scene:
    """Track the recording, if there is one, and make the scene."""
    from ikns.live.control.recorded import recorded_signal
    from ikns.motion.unseen import warn_unseen
    from ikns.view.scene import map_scene, recording_scene

    own: dict[str, Any] = {"simulated": simulated, "title": title, "point": point}
    body, learned, chain = person.skeleton, person.null_space_map, person.chain
    if frames is None:
        return map_scene(body, learned, chain, **own)
    warn_unseen(body, frames, chain)
    with progress() as report:
        motion = ikns.MarkerIK(body).track(
            frames, chain=chain, progress=partial(report, Path(frames.source).name)
        )
    c = recorded_signal(person, motion, recording=frames, method=method).raw
    if method != "paper":
        own["read_by"] = method
    return recording_scene(body, learned, chain, motion, frames, c=c, **own)


def _seconds(scene: Scene) -> float:
    return float(scene.times[-1]) if len(scene.times) else 0.0


def _rows(scene: Scene, *, points: int, given: int, size: int) -> list[list[str]]:
    rows = [
        ["PCA points", f"{points}"],
        ["seconds to play", f"{_seconds(scene):.1f}"],
        ["size of the page, MB", f"{size / 1e6:.1f}"],
    ]
    if given > len(scene.times):
        rows.insert(2, ["frames played", f"{len(scene.times)} of {given}"])
    return rows
