"""Trials and fixed effects of a mixed model, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics.table import Table, column, finite_values, labels, two_conditions


class ComparableTrials(NamedTuple):
    """Trials of the two conditions, one entry each; `trial` is None without numbers."""

    y: Array
    subject: NDArray[np.str_]
    condition: NDArray[np.str_]
    level: NDArray[np.str_]
    trial: Array | None
    names: tuple[str, str]


def comparable_trials(
    table: Table,
    value: str,
    level: str | None,
    trial: str | None,
    conditions: Sequence[str] | None,
) -> ComparableTrials:
    """Read the columns and refuse trials that cannot be compared."""
    found, names = two_conditions(table, conditions)
    used = np.isin(found, names)
    y = finite_values(np.asarray(column(table, value))[used], value)
    subject, condition = labels(table, "subject")[used], found[used]
    place = np.full(len(y), "") if level is None else labels(table, level)[used]
    people = len(np.unique(subject))
    if people < 2:
        raise NotEnoughData(f"expected at least 2 subjects, found {people}.")
    for at in np.unique(place):
        for name in names:
            if not np.any((place == at) & (condition == name)):
                raise NotEnoughData(
                    f"expected trials of {name} at {level} {str(at)!r}, found none."
                )
    if np.ptp(y) <= 1e-12 * np.abs(y).max():
        raise NotEnoughData(
            f"expected values that vary, found {len(y)} times {y[0]:g}."
        )
    k = None
    if trial is not None:
        k = finite_values(np.asarray(column(table, trial))[used], trial)
        if np.ptp(k) == 0:
            raise InvalidInput(
                f"expected a {trial} that changes, found {k[0]:g} in every row."
            )
    return ComparableTrials(y, subject, condition, place, k, names)


def fixed_effects(trials: ComparableTrials, x: Array) -> Array:
    """Columns of the effects: mean, condition, levels, condition x level, trial."""
    places = np.unique(trials.level)
    # Each level against the mean of all, so the condition's is the mean over levels.
    contrasts = np.column_stack(
        [
            (trials.level == at) * 1.0 - (trials.level == places[-1])
            for at in places[:-1]
        ]
        or [np.empty((len(x), 0))]
    )
    columns = [np.ones(len(x)), x, contrasts, contrasts * x[:, None]]
    if trials.trial is not None:
        columns.append(trials.trial - trials.trial.mean())
    design = np.column_stack(columns)
    effects = design.shape[1]
    if len(x) <= effects or np.linalg.matrix_rank(design) < effects:
        raise NotEnoughData(
            f"expected trials that tell {effects} effects apart, found {len(x)} that "
            "do not."
        )
    return design
