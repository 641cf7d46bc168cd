"""What a plan takes from a study: its declared design, or the spread of a pilot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ikns.errors import InvalidInput, NotEnoughData, naming
from ikns.experiments.study.declaration import Study
from ikns.experiments.study.summary import summarize
from ikns.statistics.assumed_spread import AssumedSpread, pilot_spread


class DeclaredDesign(NamedTuple):
    """One experiment of a study, in the same words for both experiments.

    Parameters
    ----------
    margin : float or None
        Of equivalence: RMSE, of 100, or s.
    participants : int or None
        None for a single one, who is no sample.
    levels : int
        Trajectories or objects.
    repeats : int
        Of each level in each condition.
    conditions : tuple of str
    """

    margin: float | None
    participants: int | None
    levels: int
    repeats: int
    conditions: tuple[str, ...]


class PilotSpread(NamedTuple):
    """How much differences spread in a pilot study.

    Parameters
    ----------
    found : AssumedSpread
    simulated : bool
        Whether its participants are.
    warnings : list of str
        Visits that were left out, and what simulated participants cannot say.
    """

    found: AssumedSpread
    simulated: bool
    warnings: list[str]


def declared_design(
    study: Study, experiment: Literal["tracking", "picking"]
) -> DeclaredDesign:
    """Return the design that a study declares for one experiment.

    Raises
    ------
    InvalidInput
        When the study does not have it.

    Examples
    --------
    >>> from ikns.experiments.study import study_from_table
    >>> study = study_from_table(
    ...     {"study": {"name": "x"}, "cohort": {"participants": 10}, "tracking": {}}
    ... )
    >>> declared_design(study, "tracking").levels
    3
    """
    people = study.participants if study.participants > 1 else None
    if experiment == "tracking" and study.tracking is not None:
        tracking = study.tracking
        return DeclaredDesign(
            tracking.margin,
            people,
            len(tracking.profiles),
            tracking.repeats,
            tuple(tracking.conditions),
        )
    if experiment == "picking" and study.picking is not None:
        picking = study.picking
        return DeclaredDesign(
            picking.margin_s,
            people,
            len(picking.objects),
            picking.repeats,
            tuple(picking.conditions),
        )
    raise InvalidInput(
        f"expected a study with [{experiment}], found only "
        f"[{', '.join(study.designs)}]."
    )


def spread_of_pilot(
    pilot: Path,
    experiment: Literal["tracking", "picking"],
    *,
    conditions: Sequence[str] | None = None,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> PilotSpread:
    """Measure how much the differences of a pilot study spread, from its visits.

    Parameters
    ----------
    pilot : Path
        Study folder.
    experiment : "tracking" or "picking"
        RMSE by trajectory, or time by object with failures at their limit, as they
        will be tested.
    conditions : two str, optional
        Default: the first two of the pilot.
    progress : callable
        Called with (step, done, total).

    Raises
    ------
    NotEnoughData
        When the pilot does not have this experiment, or fewer than two conditions.
    """
    summary = summarize(pilot, progress=progress)
    groups = [g for g in summary.groups if getattr(g, experiment) is not None]
    if not groups:
        raise NotEnoughData(f"{pilot}: expected visits of {experiment}, found none.")
    part = getattr(groups[0], experiment)
    trials = part.trials()
    if experiment == "tracking":
        value, level = "rmse", "trajectory"
    else:
        value, level = "time", "object"
        time = np.where(trials["success"], trials["time"], trials["limit"])
        trials = {**trials, "time": time}
    with naming(str(pilot)):
        found = pilot_spread(
            trials,
            value,
            level=level,
            conditions=conditions or _first_two(part),
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
    return PilotSpread(found, groups[0].simulated, warned)


def _first_two(part: Any) -> tuple[str, str]:
    if len(part.conditions) < 2:
        raise NotEnoughData(
            f"expected two conditions to compare, found {', '.join(part.conditions)}."
        )
    return part.conditions[0], part.conditions[1]
