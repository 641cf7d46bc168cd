"""``ikns ucm``: joint variance within and outside the null space of a task."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import ikns
from ikns.cli.options import AsJson, Force, From, SubjectFolder, To
from ikns.cli.output import notes, progress, show
from ikns.cli.picture import refuse_picture, write_picture
from ikns.cli.reading import Read, check_inputs, reads_markers, refuse_repeated
from ikns.cli.ucm_designs import over_points, over_time
from ikns.errors import InvalidInput


@reads_markers
def ucm(
    read: Read,
    recordings: Annotated[
        list[Path],
        typer.Argument(
            help="Repetitions of one movement, one file each; or a single recording "
            "with the hand held at PCA points."
        ),
    ],
    subject: SubjectFolder,
    task: Annotated[
        Literal["position", "pose"],
        typer.Option(help="What the hand holds: position, or orientation too."),
    ] = "position",
    onset_speed: Annotated[
        float,
        typer.Option(
            help="Hand speed, m/s: a repetition lasts from its first to its last "
            "crossing; in a single recording the hand is still below it.",
            min=0.0,
            max=10.0,
        ),
    ] = 0.05,
    most_different: Annotated[
        float,
        typer.Option(
            help="Largest difference between the hand paths of two repetitions, "
            "relative to their size.",
            min=0.0,
            max=10.0,
        ),
    ] = 0.25,
    surrogates: Annotated[
        int, typer.Option(help="Number of surrogates.", min=1, max=1000000)
    ] = 1000,
    seed: Annotated[
        int, typer.Option(help="Seed of the surrogates.", min=0, max=2**32 - 1)
    ] = 0,
    figure: Annotated[
        Path | None, typer.Option(help="Picture to write: .png, .svg or .pdf.")
    ] = None,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Split joint variance into that within and outside the task's null space (UCM).

    Several recordings: variance over repetitions at each normalized time. One: variance
    over the still samples at each PCA point. --from and --to take a part of every
    recording.
    """
    refuse_picture(figure, force=force, inputs=[*recordings, subject])
    refuse_repeated(recordings)
    if math.isnan(most_different):
        raise InvalidInput("expected a number for --most-different, found nan.")
    check_inputs(recordings, subject)

    from ikns.calibration.judged_motion import judged_motion
    from ikns.calibration.simulated import is_simulated

    calibrated = ikns.Subject.load(subject)
    motions: list[ikns.Motion] = []
    warned: list[str] = []
    with progress() as report:
        for path in recordings:
            motion, lacks = judged_motion(
                calibrated.skeleton,
                read(path, start=from_, end=to),
                chain=calibrated.chain,
                measured=calibrated.measured,
                report=calibrated.report,
                progress=partial(report, path.name),
            )
            motions.append(motion)
            warned += lacks
    names = [str(path) for path in recordings]
    options: dict[str, Any] = {
        "task": task,
        "speed": onset_speed,
        "surrogates": surrogates,
        "seed": seed,
    }
    found = (
        over_points(calibrated, motions, names, **options)
        if len(motions) == 1
        else over_time(
            calibrated, motions, names, most_different=most_different, **options
        )
    )
    simulated = is_simulated(calibrated, subject, recordings)
    if figure is not None:
        from ikns.view.variance_split import variance_split_figure

        drawn = variance_split_figure(**found.drawn, simulated=simulated)
        write_picture(figure, drawn, force=force)
    show(
        {
            "recordings": recordings,
            "simulated": simulated,
            "chain": str(calibrated.chain),
            "task": task,
            "onset_speed_m_s": onset_speed,
            "most_different": most_different,
            "surrogates": surrogates,
            "seed": seed,
            "figure": figure,
        }
        | found.result
        | {"warnings": [*warned, *found.result["warnings"]]},
        "Simulated subject" if simulated else "Recorded subject",
        *found.shown,
        *notes([*warned, *found.result["warnings"]]),
        *([] if figure is None else [f"Wrote {figure}"]),
        as_json=as_json,
    )
