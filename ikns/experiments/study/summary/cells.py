"""Means over subjects, cell by cell: each person counts once, however many trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = ["Cell", "Columns", "Mean", "cells", "mean_of", "ordered", "subject_means"]

Array = NDArray[np.float64]
#: A table of trials: arrays of one length by name.
Columns = Mapping[str, NDArray[Any]]


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
class Cell:
    """One condition at one level, such as a trajectory; over all levels: empty text."""

    condition: str
    level: str
    over: Mean
    trials: int


def mean_of(values: Array) -> Mean:
    """Mean over subjects of one value each; those without one are left out.

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
    """Each subject's mean over its trials among these rows, NaN left out."""
    who, y = table["subject"][rows], np.asarray(table[value][rows], dtype=np.float64)
    known = np.isfinite(y)
    people, place = np.unique(who[known], return_inverse=True)
    sums = np.bincount(place, y[known], minlength=len(people))
    counts = np.bincount(place, minlength=len(people))
    return dict(zip(people.tolist(), (sums / counts).tolist(), strict=True))


def cells(
    table: Columns,
    value: str,
    *,
    level: str,
    conditions: Sequence[str],
    levels: Sequence[str],
) -> list[Cell]:
    """Mean of every condition at every level, and over all of a subject's trials.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``condition``, the level and the value; a row is a trial.
    value, level : str
        Columns.
    conditions, levels : sequence of str
        In which order.
    """
    found = []
    for condition in conditions:
        own = table["condition"] == condition
        for name in (*levels, ""):
            rows = own & (table[level] == name) if name else own
            means = subject_means(table, value, rows)
            over = mean_of(np.array(list(means.values())))
            found.append(Cell(condition, name, over, int(rows.sum())))
    return found


def ordered(found: Sequence[str], first: Sequence[str]) -> list[str]:
    """Each word once: those known beforehand in their order, then the others.

    >>> ordered(["gamepad", "ikns", "mouse", "ikns"], ["ikns", "ring", "ikns"])
    ['ikns', 'gamepad', 'mouse']
    """
    once = list(dict.fromkeys(found))
    known = [word for word in dict.fromkeys(first) if word in once]
    return known + [word for word in once if word not in known]
