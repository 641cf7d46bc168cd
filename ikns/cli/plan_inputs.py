"""Inputs of ``ikns study plan``: options over a study's declaration, and the spread."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from ikns.errors import InvalidInput, naming

if TYPE_CHECKING:
    from ikns.experiments.study.pilot import DeclaredDesign, PilotSpread

Experiment = Literal["tracking", "picking"]
_PAPER_LEVELS = {"tracking": 3, "picking": 11}
_PAPER_REPEATS = {"tracking": 3, "picking": 1}


class PlannedDesign(NamedTuple):
    """The design to plan for, and which options override a declaration."""

    experiment: Experiment
    margin: float | None
    participants: int | None
    levels: int
    repeats: int
    seed: int
    conditions: tuple[str, str] | None
    others: list[str]
    warnings: list[str]


def resolve_plan(
    study: Path | None,
    experiment: Experiment | None,
    *,
    margin: float | None,
    participants: int | None,
    levels: int | None,
    repeats: int | None,
    seed: int | None,
) -> PlannedDesign:
    """Combine what a study declares with the options, which override it."""
    if study is None:
        name: Experiment = experiment or "tracking"
        return PlannedDesign(
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
    from ikns.experiments.study.pilot import declared_design

    found = read_study(study)
    name = experiment or ("tracking" if found.tracking is not None else "picking")
    with naming(str(study)):
        declared = declared_design(found, name)
    warned = _overrides(
        study,
        declared,
        margin=margin,
        participants=participants,
        levels=levels,
        repeats=repeats,
    )
    first, *others = declared.conditions
    if len(others) > 1:
        warned.append(
            f"planned for {first} against {others[0]}; the other comparisons of "
            f"{study} need a plan of their own."
        )
    return PlannedDesign(
        name,
        declared.margin if margin is None else margin,
        participants or declared.participants,
        levels or declared.levels,
        repeats or declared.repeats,
        found.seed if seed is None else seed,
        (first, others[0]),
        [f"Plan {x} with --experiment {x}." for x in found.designs if x != name]
        if experiment is None
        else [],
        warned,
    )


def _overrides(
    study: Path, declared: DeclaredDesign, **options: float | None
) -> list[str]:
    """Name every option that differs from what the study declares."""
    return [
        f"--{option} {given:g} instead of the {before:g} that {study} declares."
        for option, given in options.items()
        if given is not None
        and (before := getattr(declared, option)) is not None
        and given != before
    ]


def resolve_spread(
    design: PlannedDesign,
    *,
    given: tuple[float | None, float | None, float | None],
    pilot: Path | None,
    progress: Callable[[str, int, int], None],
) -> PilotSpread:
    """Return the spread: as given, of a pilot, or of the paper."""
    from ikns.experiments.study.pilot import PilotSpread, spread_of_pilot
    from ikns.statistics.assumed_spread import AssumedSpread, paper_spread
    from ikns.statistics.power import Design, Spread

    if any(part is not None for part in given):
        if pilot is not None:
            raise InvalidInput("expected --spread or --pilot, found both.")
        parts = Spread(*(part or 0.0 for part in given))
        mean = parts.of_subject_mean(Design(2, design.levels, design.repeats))
        return PilotSpread(AssumedSpread(parts, "as given", mean), False, [])
    if pilot is None:
        return PilotSpread(paper_spread(design.experiment), False, [])
    return spread_of_pilot(
        pilot, design.experiment, conditions=design.conditions, progress=progress
    )
