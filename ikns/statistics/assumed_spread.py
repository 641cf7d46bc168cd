"""Assumed spread of differences for planning a study, with its source.

Power depends on this more than on anything else, so the source is always stated: the
paper's printed figures in the worst case, or the trials of a pilot study.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics.pairs import Pairs, pair_trials
from ikns.statistics.paper import SUBJECTS, TIME, subject_spread_limit
from ikns.statistics.power import Spread
from ikns.statistics.table import Table, column, labels, numbers


@dataclass(frozen=True)
class AssumedSpread:
    """Standard deviations to plan with.

    ``source`` is a clause that names the source with its assumptions, ``deviation``
    that of the subjects' mean differences where it was found, with its 95 % interval
    ``low`` to ``high`` (NaN where it is not an estimate), ``subjects`` how many it was
    found with.
    """

    spread: Spread
    source: str
    deviation: float
    low: float = math.nan
    high: float = math.nan
    subjects: int = 0


def paper_spread(experiment: Literal["tracking", "picking"]) -> AssumedSpread:
    """Largest spread that the paper's printed figures allow, all between subjects.

    The spread of the subjects' mean differences, of RMSE (of 100) or of times (s), is
    not printed, so the largest possible one is assumed: a study planned with it has too
    many participants, not too few, and more trials per participant do not help.

    >>> round(paper_spread("tracking").deviation, 2)
    1.3
    """
    if experiment == "tracking":
        most = subject_spread_limit()
        source = (
            "the paper's printed means, deviations and p, read as all that they leave "
            "open being differences between subjects"
        )
    elif experiment == "picking":
        most = sum(float(deviation) for _, deviation in TIME.values())
        source = (
            "the paper's printed deviations of times added up, as if all of them were "
            "differences between subjects and who is slow with one condition were "
            "fast with the other; its failures are not in them"
        )
    else:
        raise InvalidInput(
            f"expected the experiment 'tracking' or 'picking', found {experiment!r}."
        )
    return AssumedSpread(Spread(most), source, most, subjects=SUBJECTS)


def pilot_spread(
    table: Table,
    value: str,
    *,
    level: str,
    conditions: Sequence[str] | None = None,
    simulated: bool = False,
) -> AssumedSpread:
    """Estimate the components of the spread from a pilot study.

    The components of :class:`Spread` follow from the mean squares of subjects, of
    subjects x levels and of repeats; negative estimates become 0. An effect of the
    level that all subjects share is no spread. Without repeats their component is part
    of that of the levels.

    Parameters
    ----------
    table, value, level, conditions
        As in :func:`ikns.statistics.pair_trials`.
    simulated : bool
        Whether the subjects are virtual, which the source then states.

    Raises
    ------
    NotEnoughData
        With fewer than 2 subjects who did all levels in both conditions, or without any
        spread.
    """
    pairs = pair_trials(
        table, value, level=level, conditions=conditions, unequal="keep"
    )
    d, people = _complete(pairs)
    n, k = d.shape
    trial, share = _repeats(table, value, level, pairs, people)
    means = d.mean(axis=1)
    deviation = float(means.std(ddof=1))
    subject, rest = k * deviation**2, 0.0
    if k > 1:
        left = d - means[:, None] - d.mean(axis=0) + d.mean()
        rest = float(np.sum(left**2)) / ((n - 1) * (k - 1))
    else:
        rest = min(trial * share, subject)
    parts = (max(subject - rest, 0.0) / k, max(rest - trial * share, 0.0), trial)
    if not any(parts):
        raise NotEnoughData("expected a pilot with differences that vary, found none.")
    chi2 = stats.chi2.isf([0.025, 0.975], n - 1)
    low, high = (deviation * math.sqrt((n - 1) / q) for q in chi2.tolist())
    return AssumedSpread(
        Spread(*(math.sqrt(part) for part in parts)),
        f"a {'simulated ' * simulated}pilot with {n} subjects",
        deviation,
        low,
        high,
        n,
    )


def _complete(pairs: Pairs) -> tuple[Array, list[str]]:
    """Differences (subjects, levels) of the subjects who have all levels."""
    levels = sorted(set(pairs.levels.tolist()))
    found: dict[str, dict[str, float]] = {}
    keys = zip(pairs.subjects.tolist(), pairs.levels.tolist(), strict=True)
    for (person, place), d in zip(keys, pairs.differences.tolist(), strict=True):
        found.setdefault(person, {})[place] = d
    whole = [person for person, row in found.items() if len(row) == len(levels)]
    if len(whole) < 2:
        raise NotEnoughData(
            "expected a pilot with at least 2 subjects who did everything in both "
            f"conditions, found {len(whole)}."
        )
    return np.array([[found[p][place] for place in levels] for p in whole]), whole


def _repeats(
    table: Table, value: str, level: str, pairs: Pairs, people: list[str]
) -> tuple[float, float]:
    """Variance of repeats, and the factor on it in a difference of their means."""
    values = numbers(column(table, value), value)
    cell = zip(
        labels(table, "subject").tolist(),
        labels(table, level).tolist(),
        labels(table, "condition").tolist(),
        strict=True,
    )
    cells: dict[Any, list[float]] = {}
    for key, one in zip(cell, values.tolist(), strict=True):
        if key[0] in people and key[2] in pairs.names:
            cells.setdefault(key, []).append(one)
    degrees = sum(len(each) - 1 for each in cells.values())
    squares = sum(len(each) * float(np.var(each)) for each in cells.values())
    share = 2.0 * float(np.mean([1 / len(each) for each in cells.values()]))
    return (squares / degrees if degrees else 0.0), share
