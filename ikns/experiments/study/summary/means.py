"""Means over subjects in each condition; trials are averaged per subject first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ikns.arrays import Array
from ikns.experiments.study.summary.trials import Columns


@dataclass(frozen=True)
class Mean:
    """A mean over subjects.

    Parameters
    ----------
    mean, deviation : float
        Standard deviation with n - 1; NaN with fewer than 2.
    low, high : float
        95 % interval of the mean, Student's t; NaN with fewer than 2.
    subjects : int
    """

    mean: float
    deviation: float
    low: float
    high: float
    subjects: int


@dataclass(frozen=True)
class ConditionMean:
    """Mean in a condition at a level, such as a trajectory; empty text: all levels."""

    condition: str
    level: str
    over: Mean
    trials: int


def mean_of(values: Array) -> Mean:
    """Return the mean over subjects of one value each, NaN excluded.

    >>> found = mean_of(np.array([1.0, 3.0, np.nan]))
    >>> found.mean, found.subjects
    (2.0, 2)
    """
    x = values[np.isfinite(values)]
    n = len(x)
    if n < 2:
        nan = math.nan
        return Mean(float(x[0]) if n else nan, nan, nan, nan, n)
    mean, deviation = float(x.mean()), float(x.std(ddof=1))
    half = float(stats.t.ppf(0.975, n - 1)) * deviation / math.sqrt(n)
    return Mean(mean, deviation, mean - half, mean + half, n)


def subject_means(
    table: Columns, value: str, rows: NDArray[np.bool_]
) -> dict[str, float]:
    """Return each subject's mean over its trials in some rows, NaN excluded."""
    who, y = table["subject"][rows], np.asarray(table[value][rows], dtype=np.float64)
    known = np.isfinite(y)
    subjects, place = np.unique(who[known], return_inverse=True)
    sums = np.bincount(place, y[known], minlength=len(subjects))
    counts = np.bincount(place, minlength=len(subjects))
    return dict(zip(subjects.tolist(), (sums / counts).tolist(), strict=True))


def condition_means(
    table: Columns,
    value: str,
    *,
    level: str,
    conditions: Sequence[str],
    levels: Sequence[str],
) -> list[ConditionMean]:
    """Return the mean of each condition at each level, and at all levels.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``condition``, the level and the value; a row is a trial.
    value, level : str
        Columns.
    conditions, levels : sequence of str
        In the order of the result.
    """
    found = []
    for condition in conditions:
        own = table["condition"] == condition
        for name in (*levels, ""):
            rows = own & (table[level] == name) if name else own
            means = subject_means(table, value, rows)
            over = mean_of(np.array(list(means.values())))
            found.append(ConditionMean(condition, name, over, int(rows.sum())))
    return found
