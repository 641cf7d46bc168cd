"""``ikns ik``: joint angles over time from a recording."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

import ikns
from ikns.cli.options import (
    AsJson,
    Force,
    From,
    MinStatic,
    OptionalMarkerSet,
    RecordingFile,
    To,
)
from ikns.cli.output import notes, progress, show, table
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.errors import InvalidInput, naming
from ikns.output.file import refuse_overwriting


@reads_markers
def ik(
    read: Read,
    recording: RecordingFile,
    subject: Annotated[
        Path | None, typer.Option(help="Folder that `ikns calibrate` wrote.")
    ] = None,
    static: Annotated[
        Path | None,
        typer.Option(help="Static trial, instead of --subject."),
    ] = None,
    marker_set: OptionalMarkerSet = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            help="File to write; repeat for more: .csv, .mot or .sto with joint "
            "angles, .trc or .c3d with the fitted markers, .osim with the body for "
            "OpenSim. Default: motion.csv."
        ),
    ] = None,
    min_static: MinStatic = 1.0,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write joint angles (deg), the pose of the thorax and residuals per frame.

    The body is that of a subject, or scaled from --static with --marker-set. Cells are
    empty in frames that do not show the thorax or a segment next to the joint, or whose
    markers of the arm cannot be right; .mot and .sto cannot have empty cells, so they
    omit such frames. A recording that must not be used is refused, as by `ikns check`.

    No model that comes with OpenSim has the joints of this body: write --out body.osim
    too, open it in OpenSim, and load the .mot there as a motion.
    """
    outputs = out or [Path("motion.csv")]
    _check(outputs, recording, subject, static, marker_set, force=force)
    check_inputs([recording, static], subject)

    from ikns.calibration.judged_motion import judged_motion
    from ikns.motion.export import write_motion
    from ikns.motion.file_names import MODEL, STORAGE
    from ikns.motion.lab_vertical import lab_vertical
    from ikns.motion.table import limits_passed, motion_table

    left_out: list[str] = []
    still, measured, calibration = None, True, None
    if static is None:
        assert subject is not None
        person = ikns.Subject.load(subject)
        skeleton, measured = person.skeleton, person.measured
        calibration = person.report
    else:
        still = read(static)
        skeleton, left_out = _scaled(still, marker_set, min_static)
    frames = read(recording, start=from_, end=to)
    with progress() as report, naming(frames.source):
        motion, warned = judged_motion(
            skeleton,
            frames,
            static=still,
            measured=measured,
            report=calibration,
            progress=partial(report, "joint angles"),
        )
    up = None
    if any(path.suffix.lower() in (MODEL, *STORAGE) for path in outputs):
        upright = motion if still is None else ikns.MarkerIK(skeleton).track(still)
        up = lab_vertical(upright)
    told = [
        write_motion(path, motion, skeleton, up=up, force=force) for path in outputs
    ]
    told += _cautions(motion, outputs, up)
    said = [*left_out, *(sentence for sentence in told if sentence), *warned]
    csv = next((path for path in outputs if path.suffix.lower() == ".csv"), None)
    found = motion_table(motion)
    summary = found.summary
    beyond = limits_passed(skeleton, found.range_deg)
    show(
        {"recording": recording, "csv": csv, "files": outputs, "notes": said}
        | summary
        | {"beyond_limit_deg": beyond},
        f"{recording}: {summary['frames_converged']} of {summary['frames']} frames "
        f"solved, median marker residual {1000 * summary['residual_median_m']:.1f} mm",
        _angles(found.range_deg, motion.held, beyond),
        *notes(said),
        f"Wrote {', '.join(map(str, outputs))}",
        as_json=as_json,
    )


def _check(
    outputs: list[Path],
    recording: Path,
    subject: Path | None,
    static: Path | None,
    marker_set: str | None,
    *,
    force: bool,
) -> None:
    """Refuse, before any work, files and options that do not go together."""
    from ikns.motion.file_names import check_motion_file

    for path in outputs:
        refuse_overwriting(path, force=force, inputs=[recording, subject, static])
        check_motion_file(path)
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise InvalidInput("each --out needs a file of its own, found one twice.")
    if (subject is None) == (static is None):
        raise InvalidInput(
            "expected --subject, a folder of `ikns calibrate`, or --static, a "
            f"recording, found {'neither' if subject is None else 'both'}."
        )
    if subject is not None and marker_set is not None:
        raise InvalidInput(
            "--marker-set works only with --static; a subject has its own markers."
        )


def _cautions(motion: ikns.Motion, outputs: list[Path], up: Any) -> list[str]:
    """Say what whoever opens the files has to know."""
    from ikns.motion.file_names import MODEL, STORAGE
    from ikns.motion.gimbal import gimbal_sentence
    from ikns.motion.lab_vertical import up_sentence

    endings = {path.suffix.lower() for path in outputs}
    angles = bool(endings & {*STORAGE})
    told = [gimbal_sentence(motion, thorax=angles)]
    if angles or MODEL in endings:
        told.append(up_sentence(up, model=MODEL in endings))
    if angles and MODEL not in endings:
        told.append(
            "the coordinates are those of this body, which no model that comes with "
            f"OpenSim has; --out body{MODEL} writes it as a model."
        )
    return told


def _scaled(
    still: ikns.Recording, marker_set: str | None, min_static: float
) -> tuple[ikns.Skeleton, list[str]]:
    """Return the body of a static trial, and what was left out of it."""
    with naming(still.source):
        skeleton, scaling = ikns.scale(
            ikns.Skeleton.load(),
            still,
            marker_set=marker_set or "oxford24",
            min_duration=min_static,
        )
    return skeleton, scaling.sentences(still.source)


def _angles(
    range_deg: dict[str, tuple[float, float]],
    held: tuple[str, ...],
    beyond: dict[str, float],
) -> Any:
    """Return the table of joint angles."""
    return table(
        "Joint angles",
        {"joint": "s", "lowest deg": ".1f", "highest deg": ".1f", "note": "s"},
        [
            [name, low, high, _note(name, low, held, beyond)]
            for name, (low, high) in range_deg.items()
        ],
    )


def _note(
    joint: str, lowest: float, held: tuple[str, ...], beyond: dict[str, float]
) -> str:
    if joint in held:
        return "held: no marker shows it"
    if joint in beyond:
        return f"beyond its limit, {beyond[joint]:.0f}"
    return "never visible" if math.isnan(lowest) else ""
