"""What ``ikns study plan`` plans, and how much it takes differences to spread."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from ikns.errors import InvalidInput, NotEnoughData, naming

if TYPE_CHECKING:
    from ikns.experiments.study import Study
    from ikns.statistics.assumed_spread import AssumedSpread

__all__ = ["Assumed", "Planned", "assume", "planned"]

Experiment = Literal["tracking", "picking"]
_PAPER_LEVELS = {"tracking": 3, "picking": 11}
_PAPER_REPEATS = {"tracking": 3, "picking": 1}


class Planned(NamedTuple):
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


class Assumed(NamedTuple):
    """Where the spread is from."""

    found: AssumedSpread
    simulated: bool
    warnings: list[str]


def planned(
    study: Path | None,
    experiment: Experiment | None,
    *,
    margin: float | None,
    participants: int | None,
    levels: int | None,
    repeats: int | None,
    seed: int | None,
) -> Planned:
    """Take what the study declares, and what the options say instead."""
    if study is None:
        name: Experiment = experiment or "tracking"
        return Planned(
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
    return Planned(
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


def assume(
    design: Planned,
    *,
    given: tuple[float | None, float | None, float | None],
    pilot: Path | None,
    report: Any,
) -> Assumed:
    """Find the spread: given, of a pilot, or of the paper."""
    from ikns.statistics.assumed_spread import AssumedSpread, paper_spread
    from ikns.statistics.power import Design, Spread

    if any(part is not None for part in given):
        if pilot is not None:
            raise InvalidInput("expected --spread or --pilot, found both.")
        parts = Spread(*(part or 0.0 for part in given))
        mean = parts.of_subject_mean(Design(2, design.levels, design.repeats))
        return Assumed(AssumedSpread(parts, "as given", mean), False, [])
    if pilot is None:
        return Assumed(paper_spread(design.experiment), False, [])
    return _of_pilot(pilot, design, report)


def _of_pilot(pilot: Path, design: Planned, report: Any) -> Assumed:
    """Measure the trials of a pilot again, from its visits."""
    import numpy as np

    from ikns.experiments.study.summary import summarize
    from ikns.statistics.assumed_spread import pilot_spread

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
    return Assumed(found, groups[0].simulated, warned)


def _two(part: Any) -> tuple[str, str]:
    if len(part.conditions) < 2:
        raise NotEnoughData(
            f"expected two conditions to compare, found {', '.join(part.conditions)}."
        )
    return part.conditions[0], part.conditions[1]
