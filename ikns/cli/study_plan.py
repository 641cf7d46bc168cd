"""``ikns study plan``: how many participants a declared margin needs."""

from __future__ import annotations

import math
import textwrap
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ikns.cli.options import AsJson, Force
from ikns.cli.output import loading, notes, progress, show, table
from ikns.cli.picture import refuse_picture, write_picture
from ikns.cli.plan_inputs import PlannedDesign, resolve_plan, resolve_spread
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.study.pilot import PilotSpread
    from ikns.statistics.assumed_spread import AssumedSpread
    from ikns.statistics.plan import SamplingPlan
    from ikns.statistics.power import Power

#: Quantity, unit, and the levels over which a participant's trials are averaged.
_VALUE = {
    "tracking": ("RMSE", "of 100", "trajectories"),
    "picking": ("time", "s", "objects"),
}
#: Larger than any RMSE, and any time of a trial in s.
_LARGEST_MARGIN = 1e6


def plan(
    study: Annotated[
        Path | None,
        typer.Argument(help="Study that declares the margin, design and seed."),
    ] = None,
    experiment: Annotated[
        Literal["tracking", "picking"] | None,
        typer.Option(help="Experiment. Default: the first that the study declares."),
    ] = None,
    margin: Annotated[
        float | None,
        typer.Option(help="Margin of equivalence: RMSE of 100, or s."),
    ] = None,
    difference: Annotated[
        float,
        typer.Option(
            help="True difference. Without a margin: the difference to detect.",
            min=-1000000.0,
            max=1000000.0,
        ),
    ] = 0.0,
    participants: Annotated[
        int | None, typer.Option(help="Number of participants.", min=2, max=5000)
    ] = None,
    levels: Annotated[
        int | None,
        typer.Option(help="Number of trajectories or objects.", min=1, max=1000),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            help="Repetitions of each trajectory or object in each condition.",
            min=1,
            max=1000,
        ),
    ] = None,
    spread: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation of the difference between participants.",
            max=1000000.0,
        ),
    ] = None,
    level_spread: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation between trajectories or objects within a "
            "participant; with --spread.",
            max=1000000.0,
        ),
    ] = None,
    trial_spread: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation between repetitions of one condition; with "
            "--spread.",
            max=1000000.0,
        ),
    ] = None,
    pilot: Annotated[
        Path | None,
        typer.Option(help="Pilot study whose visits give the spread of differences."),
    ] = None,
    power: Annotated[float, typer.Option(help="Target power.")] = 0.8,
    alpha: Annotated[
        float, typer.Option(help="Significance level of each one-sided test.")
    ] = 0.05,
    most: Annotated[
        int,
        typer.Option(help="Largest number of participants to try.", min=2, max=5000),
    ] = 500,
    simulations: Annotated[
        int,
        typer.Option(
            help="Simulated studies per number of participants.", min=1, max=1000000
        ),
    ] = 10_000,
    seed: Annotated[
        int | None,
        typer.Option(help="Seed of the simulated studies.", min=0, max=2**32 - 1),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Power curve to write, .png, .svg or .pdf.")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Compute the number of participants that a study needs.

    Power by simulation: studies are drawn from an assumed spread and tested as the real
    one will be, one mean per participant. The spread is the paper's, a pilot's, or
    given; everything depends on it, so it is printed with its source.
    """
    refuse_picture(figure, force=force, inputs=[study, pilot])
    if margin is not None and margin > _LARGEST_MARGIN:
        raise InvalidInput(
            f"expected a --margin above 0 and up to {_LARGEST_MARGIN:g}, found "
            f"{margin:g}."
        )
    loading()

    from ikns.statistics.plan import plan_participants

    design = resolve_plan(
        study,
        experiment,
        margin=margin,
        participants=participants,
        levels=levels,
        repeats=repeats,
        seed=seed,
    )
    if design.margin is None and difference == 0:
        where = "" if study is None else f"{study}: "
        raise InvalidInput(
            f"{where}expected a margin for {design.experiment}, declared in the study "
            "file or by --margin, or a --difference to be shown, found neither."
        )
    with progress(kernels=False) as report:
        assumed = resolve_spread(
            design,
            given=(spread, level_spread, trial_spread),
            pilot=pilot,
            progress=report,
        )
    made = plan_participants(
        assumed.found.spread,
        participants=design.participants,
        levels=design.levels,
        repeats=design.repeats,
        difference=difference,
        margin=design.margin,
        alpha=alpha,
        target=power,
        most=most,
        simulations=simulations,
        seed=design.seed,
    )
    unit = {"tracking": "RMSE (of 100)", "picking": "s"}[design.experiment]
    aim = (
        f"a difference of {difference:g} {unit}"
        if design.margin is None
        else f"equivalence within {design.margin:g} {unit}"
    )
    if figure is not None:
        note = _assumption(assumed.found, design)
        drawn = _drawn(made, assumed, aim=aim, target=power, note=note)
        write_picture(figure, drawn, force=force)
    warned = design.warnings + assumed.warnings
    show(
        _result(study, pilot, design, assumed, made)
        | {"alpha": alpha, "target": power, "difference": difference}
        | {"simulations": simulations, "figure": figure, "warnings": warned},
        _curve_table(
            made, f"Power to show {aim}, {simulations} simulated studies each"
        ),
        _assumption(assumed.found, design),
        made.size.sentence(),
        *([] if made.declared is None else [made.declared.sentence()]),
        *design.others,
        *([] if figure is None else [f"Wrote {figure}"]),
        *notes(warned),
        as_json=as_json,
    )


def _assumption(found: AssumedSpread, design: PlannedDesign) -> str:
    """Return a sentence with the assumed spread of the differences and its source."""
    quantity, unit, over = _VALUE[design.experiment]
    parts = found.spread
    deviations = [f"{parts.subject:.3g} {unit} between participants"]
    if parts.level:
        deviations.append(f"{parts.level:.3g} between {over} within a participant")
    if parts.trial:
        deviations.append(f"{parts.trial:.3g} of repeats of a condition")
    interval = ""
    if math.isfinite(found.low):
        interval = (
            f"; their mean differences had a standard deviation of "
            f"{found.deviation:.3g}, 95 % interval {found.low:.3g} to {found.high:.3g}"
        )
    return (
        f"Assumed: differences of {quantity} with standard deviations of "
        f"{', '.join(deviations)} ({found.source}{interval})."
    )


def _curve_table(made: SamplingPlan, title: str) -> Any:
    needed, declared = made.size.subjects, made.declared

    def mark(power: Power) -> str:
        n = power.design.subjects
        words = ["needed"] * (n == needed)
        return ", ".join(words + ["declared"] * (power == declared))

    return table(
        title,
        {"participants": "d", "power\n%": ".1f", "95 % interval\n%": "s", "": "s"},
        [
            [
                power.design.subjects,
                100 * power.power,
                f"{100 * power.low:.1f} to {100 * power.high:.1f}",
                mark(power),
            ]
            for power in made.curve
        ],
    )


def _result(
    study: Path | None,
    pilot: Path | None,
    design: PlannedDesign,
    assumed: PilotSpread,
    made: SamplingPlan,
) -> dict[str, Any]:
    quantity, unit, _ = _VALUE[design.experiment]
    size = made.size

    def row(power: Power) -> dict[str, Any]:
        return {
            "participants": power.design.subjects,
            "power": power.power,
            "low": power.low,
            "high": power.high,
        }

    return {
        "study": study,
        "experiment": design.experiment,
        "quantity": quantity,
        "unit": unit,
        "margin": design.margin,
        "design": {
            "participants": design.participants,
            "levels": design.levels,
            "repeats": design.repeats,
            "conditions": design.conditions,
        },
        "spread": asdict(assumed.found.spread)
        | {
            "source": assumed.found.source,
            "of_subject_means": assumed.found.deviation,
            "of_subject_means_interval": [assumed.found.low, assumed.found.high],
            "pilot": pilot,
            "pilot_simulated": assumed.simulated,
        },
        "power": [row(power) for power in made.curve],
        "sample_size": {
            "participants": size.subjects,
            "tried": [row(power) for power in size.tried],
        },
        "declared": None if made.declared is None else row(made.declared),
        "seed": design.seed,
    }


def _drawn(
    made: SamplingPlan,
    assumed: PilotSpread,
    *,
    aim: str,
    target: float,
    note: str,
) -> Any:
    from ikns.view.power import power_figure

    return power_figure(
        [power.design.subjects for power in made.curve],
        [power.power for power in made.curve],
        [[power.low for power in made.curve], [power.high for power in made.curve]],
        aim=aim,
        target=target,
        simulated=assumed.simulated,
        needed=made.size.subjects,
        declared=None if made.declared is None else made.declared.design.subjects,
        note=textwrap.fill(note, 105),
    )
