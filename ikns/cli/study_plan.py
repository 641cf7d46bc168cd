"""``ikns study plan``: how many participants a declared margin takes."""

from __future__ import annotations

import math
import textwrap
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from ikns.cli.options import AsJson, Force
from ikns.cli.output import notes, progress, show, table
from ikns.cli.picture import refuse_picture, write_picture
from ikns.errors import InvalidInput, NotEnoughData, naming

if TYPE_CHECKING:
    from ikns.experiments.statistics.assumed_spread import AssumedSpread
    from ikns.experiments.statistics.plan import Plan
    from ikns.experiments.statistics.power import Power
    from ikns.experiments.study import Study

__all__ = ["plan"]

Experiment = Literal["tracking", "picking"]

#: What is compared, in which unit, and over what a participant's trials are averaged.
_VALUE = {
    "tracking": ("RMSE", "of 100", "trajectories"),
    "picking": ("time", "s", "objects"),
}
_PAPER_LEVELS = {"tracking": 3, "picking": 11}
_PAPER_REPEATS = {"tracking": 3, "picking": 1}


class _Design(NamedTuple):
    """What is planned, and which of it overrides a declaration."""

    experiment: Experiment
    margin: float | None
    participants: int | None
    levels: int
    repeats: int
    seed: int
    conditions: tuple[str, str] | None
    others: list[str]
    warnings: list[str]


class _Assumed(NamedTuple):
    """Where the spread is from."""

    found: AssumedSpread
    simulated: bool
    warnings: list[str]


def plan(
    study: Annotated[
        Path | None,
        typer.Argument(help="Study whose margin, design and seed are taken."),
    ] = None,
    experiment: Annotated[
        Literal["tracking", "picking"] | None,
        typer.Option(help="Which one; of a study: the first declared."),
    ] = None,
    margin: Annotated[
        float | None,
        typer.Option(
            help="Difference that does not matter: RMSE of 100, or s. Equivalence "
            "within it is to be shown.",
        ),
    ] = None,
    difference: Annotated[
        float,
        typer.Option(help="True one; without a margin it is to be shown."),
    ] = 0.0,
    participants: Annotated[
        int | None, typer.Option(help="How many the study has.", min=2)
    ] = None,
    levels: Annotated[
        int | None, typer.Option(help="Trajectories or objects.", min=1)
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(help="Of each in each condition.", min=1)
    ] = None,
    spread: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation of the difference from participant to participant."
        ),
    ] = None,
    level_spread: Annotated[
        float | None,
        typer.Option(help="From level to level within a participant; with --spread."),
    ] = None,
    trial_spread: Annotated[
        float | None,
        typer.Option(help="Of repeats of one condition; with --spread."),
    ] = None,
    pilot: Annotated[
        Path | None,
        typer.Option(help="Study whose visits say how much differences spread."),
    ] = None,
    power: Annotated[float, typer.Option(help="That is wanted.")] = 0.8,
    alpha: Annotated[float, typer.Option(help="Of each one-sided test.")] = 0.05,
    most: Annotated[
        int, typer.Option(help="Participants to try at most.", min=2, max=5000)
    ] = 500,
    simulations: Annotated[
        int, typer.Option(help="Studies simulated per number of participants.", min=1)
    ] = 10_000,
    seed: Annotated[
        int | None, typer.Option(help="Of the simulated studies.", min=0)
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Power curve to write, .png, .svg or .pdf.")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Say with how many participants a study can answer its question.

    Power by simulation: studies are drawn from an assumed spread and tested as the real
    one will be, one mean per participant. The spread is the paper's, a pilot's, or
    given; it is named with its source, for everything depends on it.
    """
    from ikns.experiments.statistics.plan import plan_participants

    refuse_picture(figure, force=force)
    design = _design(
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
    with progress() as report:
        assumed = _spread(
            design,
            given=(spread, level_spread, trial_spread),
            pilot=pilot,
            report=report,
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
        said = _assumption(assumed.found, design)
        _draw(figure, made, assumed, aim=aim, target=power, said=said)
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


def _design(
    study: Path | None,
    experiment: Experiment | None,
    *,
    margin: float | None,
    participants: int | None,
    levels: int | None,
    repeats: int | None,
    seed: int | None,
) -> _Design:
    """Take what the study declares, and what the options say instead."""
    if study is None:
        name: Experiment = experiment or "tracking"
        return _Design(
            name,
            margin,
            participants,
            levels or _PAPER_LEVELS[name],
            repeats or _PAPER_REPEATS[name],
            seed or 0,
            None,
            [],
            [],
        )
    from ikns.experiments.study import read_study

    found = read_study(study)
    name = experiment or ("tracking" if found.tracking is not None else "picking")
    said = _declared(found, name, study)
    warned = [
        f"{option} {given:g} instead of the {declared:g} that {study} declares."
        for option, given, declared in (
            ("--margin", margin, said["margin"]),
            ("--participants", participants, said["participants"]),
            ("--levels", levels, said["levels"]),
            ("--repeats", repeats, said["repeats"]),
        )
        if given is not None and declared is not None and given != declared
    ]
    first, *others = said["conditions"]
    if len(others) > 1:
        warned.append(
            f"planned for {first} against {others[0]}; the other comparisons of "
            f"{study} need a plan of their own."
        )
    return _Design(
        name,
        said["margin"] if margin is None else margin,
        participants or said["participants"],
        levels or said["levels"],
        repeats or said["repeats"],
        found.seed if seed is None else seed,
        (first, others[0]),
        [f"Plan {x} with --experiment {x}." for x in found.designs if x != name]
        if experiment is None
        else [],
        warned,
    )


def _declared(found: Study, experiment: Experiment, study: Path) -> dict[str, Any]:
    """Read one experiment of a study in the words of both."""
    people = found.participants if found.participants > 1 else None
    if experiment == "tracking" and found.tracking is not None:
        tracking = found.tracking
        return {
            "margin": tracking.margin,
            "participants": people,
            "levels": len(tracking.profiles),
            "repeats": tracking.repeats,
            "conditions": tracking.conditions,
        }
    if experiment == "picking" and found.picking is not None:
        picking = found.picking
        return {
            "margin": picking.margin_s,
            "participants": people,
            "levels": len(picking.objects),
            "repeats": picking.repeats,
            "conditions": picking.conditions,
        }
    raise InvalidInput(
        f"{study}: expected a study with [{experiment}], found only "
        f"[{', '.join(found.designs)}]."
    )


def _spread(
    design: _Design,
    *,
    given: tuple[float | None, float | None, float | None],
    pilot: Path | None,
    report: Any,
) -> _Assumed:
    """Find the spread: given, of a pilot, or of the paper."""
    from ikns.experiments.statistics.assumed_spread import AssumedSpread, paper_spread
    from ikns.experiments.statistics.power import Design, Spread

    if any(part is not None for part in given):
        if pilot is not None:
            raise InvalidInput("expected --spread or --pilot, found both.")
        parts = Spread(*(part or 0.0 for part in given))
        mean = parts.of_subject_mean(Design(2, design.levels, design.repeats))
        return _Assumed(AssumedSpread(parts, "as given", mean), False, [])
    if pilot is None:
        return _Assumed(paper_spread(design.experiment), False, [])
    return _of_pilot(pilot, design, report)


def _of_pilot(pilot: Path, design: _Design, report: Any) -> _Assumed:
    """Measure the trials of a pilot again, from its visits."""
    import numpy as np

    from ikns.experiments.statistics.assumed_spread import pilot_spread
    from ikns.experiments.summary import summarize

    summary = summarize(pilot, progress=report)
    groups = [g for g in summary.groups if getattr(g, design.experiment) is not None]
    if not groups:
        raise NotEnoughData(
            f"{pilot}: expected visits of {design.experiment}, found none."
        )
    part = getattr(groups[0], design.experiment)
    trials = part.trials()
    if design.experiment == "tracking":
        value, level = "rmse", "trajectory"
    else:  # failures at the limit, as they will be tested
        value, level = "time", "object"
        late = np.where(trials["success"], trials["time"], trials["limit"])
        trials = {**trials, "time": late}
    with naming(str(pilot)):
        found = pilot_spread(
            trials,
            value,
            level=level,
            conditions=design.conditions or _two(part),
            simulated=part.simulated,
        )
    warned = [left.reason for left in summary.left_out]
    if groups[0].simulated:
        warned.append(
            f"the pilot {pilot} is simulated: virtual participants spread as their "
            "parameters say, people as they do."
        )
    if len(groups) > 1:
        warned.append(f"the simulated participants of {pilot} are left out.")
    return _Assumed(found, groups[0].simulated, warned)


def _two(part: Any) -> tuple[str, str]:
    if len(part.conditions) < 2:
        raise NotEnoughData(
            f"expected two conditions to compare, found {', '.join(part.conditions)}."
        )
    return part.conditions[0], part.conditions[1]


def _assumption(found: AssumedSpread, design: _Design) -> str:
    """Say how much the differences are taken to spread, and who says so."""
    quantity, unit, over = _VALUE[design.experiment]
    parts = found.spread
    told = [f"{parts.subject:.3g} {unit} between participants"]
    if parts.level:
        told.append(f"{parts.level:.3g} between {over} within a participant")
    if parts.trial:
        told.append(f"{parts.trial:.3g} of repeats of a condition")
    interval = ""
    if math.isfinite(found.low):
        interval = (
            f"; their mean differences had a standard deviation of "
            f"{found.deviation:.3g}, 95 % interval {found.low:.3g} to {found.high:.3g}"
        )
    return (
        f"Assumed: differences of {quantity} with standard deviations of "
        f"{', '.join(told)} ({found.source}{interval})."
    )


def _curve_table(made: Plan, title: str) -> Any:
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
    design: _Design,
    assumed: _Assumed,
    made: Plan,
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


def _draw(
    path: Path, made: Plan, assumed: _Assumed, *, aim: str, target: float, said: str
) -> None:
    from ikns.view.power import power_figure

    drawn = power_figure(
        [power.design.subjects for power in made.curve],
        [power.power for power in made.curve],
        [[power.low for power in made.curve], [power.high for power in made.curve]],
        aim=aim,
        target=target,
        simulated=assumed.simulated,
        needed=made.size.subjects,
        declared=None if made.declared is None else made.declared.design.subjects,
        note=textwrap.fill(said, 105),
    )
    write_picture(path, drawn)
