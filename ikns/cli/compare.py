"""``ikns compare``: what was learned against what the Jacobian says."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import ikns
from ikns.cli.comparison_json import Named, found_json
from ikns.cli.comparison_rows import comparison_rows
from ikns.cli.comparison_tables import HELD, found_tables
from ikns.cli.options import (
    AnyMethod,
    AsJson,
    Force,
    From,
    RecordingFile,
    SubjectFolder,
    To,
)
from ikns.cli.output import notes, progress, show
from ikns.cli.picture import refuse_picture, write_picture
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.cli.steps_left import one_bar
from ikns.errors import NotEnoughData, naming

if TYPE_CHECKING:
    from ikns.analysis.compare import Crosstalk
    from ikns.body.chains import ChainLike
    from ikns.nullspace.readout import Readout

_UNITS = {"max_hand_speed": "m_s", "min_duration": "s"}
#: Why another method has no comparison of directions.
_PAPER_ONLY = (
    "directions, leak and bend are those of the paper's Z over all joint angles of the "
    "chain, compared with the Jacobian over the same; {method} uses no "
    "such direction, so only crosstalk is that of its c."
)
#: Steps after the tracking; their costs are CPU s of the 40 points of four comparisons.
_POINTS, _COMBINED, _CROSSTALK = "points", "comparisons", "crosstalk"


@reads_markers
def compare(
    read: Read,
    recording: RecordingFile,
    subject: SubjectFolder,
    task: Annotated[
        Literal["both", "pose", "position"],
        typer.Option(
            help="What the hand holds: position and orientation, or position."
        ),
    ] = "both",
    chain: Annotated[
        str,
        typer.Option(
            metavar="own|both|NAME|FILE",
            help="Joints to compare: own, those of the map; both, also those with the "
            "clavicle if the map has none, else without it, learned again; or another "
            "chain of the same hand, by its name or from a .toml file.",
        ),
    ] = "both",
    coordinates: Annotated[
        Literal["internal", "isb", "rotation_vector", "all"],
        typer.Option(help="Shoulder coordinates. All but internal are learned again."),
    ] = "internal",
    reaches: Annotated[
        Path | None, typer.Option(help="Recording of natural reaches, for crosstalk.")
    ] = None,
    method: AnyMethod = "paper",
    figure: Annotated[
        Path | None, typer.Option(help="Picture to write, .png, .svg or .pdf.")
    ] = None,
    intervals: Annotated[
        int,
        typer.Option(
            help="Number of resamples for the 95 % intervals; 0 for none.",
            min=0,
            max=100000,
        ),
    ] = 400,
    seed: Annotated[
        int, typer.Option(help="Seed of the resamples.", min=0, max=2**32 - 1)
    ] = 0,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Compare learned and analytic directions at every PCA point.

    Angles between them, with what chance would give; the share of joint variance inside
    the null space; the hand's leak and turn as c goes from 0 to 1; where the hand goes
    along a straight line along Z; how far the null space bends; and crosstalk.
    Directions are the paper's; crosstalk is that of --method. --from and --to take a
    part of the recording, not of --reaches.
    """
    from ikns.body.chain_files import chain_file, load_chain

    named = None if chain in ("own", "both") else load_chain(chain)
    inputs = [recording, reaches, subject, chain_file(chain)[0]]
    refuse_picture(figure, force=force, inputs=inputs)
    check_inputs([recording, reaches], subject)

    from ikns.calibration.simulated import is_simulated
    from ikns.calibration.steps import tracking_steps

    calibrated = ikns.Subject.load(subject)
    own = calibrated.chain
    with naming(str(subject)):
        readout = calibrated.readout(method)
    given = [(recording, read(recording, start=from_, end=to))]
    if reaches is not None:
        given.append((reaches, read(reaches)))
    gate = calibrated.gate
    first: Literal["pose", "position"] = "position" if task == "position" else "pose"
    options: dict[str, Any] = {"resamples": intervals, "seed": seed}
    estimates: dict[str, Any] = {}
    with progress(estimates=estimates) as report:
        steps = tracking_steps([frames for _, frames in given], judged=True)
        steps += [(_POINTS, 0.3), (_COMBINED, 1.2), (_CROSSTALK, 0.1)]
        told = one_bar("comparing", steps, report, estimates)
        tracked, judged = _tracked(calibrated, given, told)
        motion, reaching = tracked[0], tracked[-1]
        told(_POINTS, 0, 1)
        rows, warned = comparison_rows(
            calibrated, motion, source=str(recording), task=first
        )
        found, left_out = _combinations(
            calibrated,
            motion,
            source=str(recording),
            tasks=("pose", "position") if task == "both" else (first,),
            counterpart=chain == "both",
            named=named,
            coordinates=coordinates,
            options=options | gate | {"progress": partial(told, _COMBINED)},
        )
        warned += left_out + judged
        told(_CROSSTALK, 0, 1)
        with naming(str(reaches or recording)):
            across = _crosstalk(
                calibrated, readout, reaching, None if reaches else warned, **options
            )
    if method != "paper":
        warned.append(_PAPER_ONLY.format(method=method))
    simulated = is_simulated(
        calibrated, subject, [p for p in (recording, reaches) if p is not None]
    )
    plain = [
        each
        for each in found
        if each[0][0] == str(own) and each[0][2] == found[0][0][2]
    ]
    if figure is not None:
        _draw(figure, plain, across, simulated=simulated, force=force)
    title = f"{'Simulated, ' if simulated else ''}{recording}"
    show(
        {
            "recording": recording,
            "reaches": reaches,
            "simulated": simulated,
            "chain": str(own),
            "method": method,
            "task": task,
            "settings": _settings(options, gate),
            "points": rows,
            **found_json(found, across, recording=reaches or recording),
            "figure": figure,
            "warnings": warned,
        },
        *found_tables(found, plain, across, title=title, intervals=intervals > 0),
        *([] if figure is None else [f"Wrote {figure}"]),
        *notes(warned),
        as_json=as_json,
    )


def _settings(options: dict[str, Any], gate: dict[str, float]) -> dict[str, Any]:
    """Return how intervals were made and which samples were taken."""
    units = {f"{name}_{_UNITS[name]}": value for name, value in gate.items()}
    return options | {"level": 0.95} | units


def _crosstalk(
    subject: ikns.Subject,
    readout: Readout,
    motion: ikns.Motion,
    warned: list[str] | None,
    **options: Any,
) -> Crosstalk | None:
    """Return the change of a method's c on natural reaches.

    Without reaches it warns, or raises where there is no list of warnings.
    """
    from ikns.analysis.compare import motion_crosstalk

    try:
        return motion_crosstalk(
            subject.null_space_map,
            motion,
            chain=subject.chain,
            c=readout.control_signal(subject.skeleton, motion),
            max_hand_speed=subject.gate["max_hand_speed"],
            **options,
        )
    except NotEnoughData as error:
        if warned is None:
            raise
        warned.append(f"no crosstalk: {error}")
        return None


def _tracked(
    subject: ikns.Subject,
    given: list[tuple[Path, ikns.Recording]],
    report: Callable[[str, int, int], None],
) -> tuple[list[ikns.Motion], list[str]]:
    """Judge and track recordings, and say what they lack."""
    from ikns.calibration.judged_motion import judged_motion

    motions, warned = [], []
    for _, frames in given:
        motion, lacks = judged_motion(
            subject.skeleton,
            frames,
            chain=subject.chain,
            measured=subject.measured,
            report=subject.report,
            progress=partial(report, Path(frames.source).name),
        )
        motions.append(motion)
        warned += lacks
    return motions, warned


def _combinations(
    subject: ikns.Subject,
    motion: ikns.Motion,
    *,
    source: str,
    tasks: tuple[Literal["pose", "position"], ...],
    counterpart: bool,
    named: ChainLike | None,
    coordinates: str,
    options: dict[str, Any],
) -> tuple[list[Named], list[str]]:
    """Return the comparisons asked for, and warnings of chains that have none.

    Besides the map's chain they are of its counterpart with or without the clavicle, or
    of another one that is named.
    """
    from ikns.analysis.compare import COORDINATES, compare_combinations
    from ikns.body.chains import as_chain, clavicle_counterpart
    from ikns.body.skeleton import check_chain

    own = subject.chain
    other: ChainLike | None = clavicle_counterpart(own) if counterpart else None
    if named is not None and as_chain(named) != as_chain(own):
        other = check_chain(subject.skeleton, named)
    with naming(source):
        compared = compare_combinations(
            subject.null_space_map,
            subject.skeleton,
            motion,
            chain=own,
            chains=(own,) if other is None else (own, other),
            tasks=tasks,
            coordinates=COORDINATES if coordinates == "all" else (coordinates,),
            **options,
        )
    reasons = compared.left_out.items()
    return (
        list(compared.found.items()),
        [f"{name} left out: {source}: {reason}" for name, reason in reasons],
    )


def _draw(
    path: Path, found: list[Named], across: Any, *, simulated: bool, force: bool
) -> None:
    from ikns.view.comparison import comparison_figure

    drawn = comparison_figure(
        {f"hand {HELD[names[1]]} held": each for names, each in found},
        simulated=simulated,
        crosstalk=across,
    )
    write_picture(path, drawn, force=force)
