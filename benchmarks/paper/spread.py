"""Spread of the paper's differences that its printed means and deviations allow.

10 subjects x 3 trajectories make 30 differences d of RMSE, IKNS minus gamepad. Printed
are, per trajectory and condition, mean and standard deviation over subjects.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from paper.printed import PAPER

__all__ = [
    "MARGINS",
    "difference_range",
    "spread_range",
    "standard_error",
    "tost_p",
]

#: RMSE, of a signal of 0 to 100: examples, for the paper declares none.
MARGINS = (0.25, 0.5, 1.0)


def _means() -> tuple[NDArray[np.float64], float]:
    """Differences of the trajectories' means, and what rounding may add to each."""
    pairs = list(zip(PAPER.ikns, PAPER.gamepad, strict=True))
    d = np.array([a.value - b.value for (a, _), (b, _) in pairs])
    return d, max(a.half + b.half for (a, _), (b, _) in pairs)


def difference_range() -> tuple[float, float, float]:
    """Mean difference as printed, and its least and most within rounding."""
    d, rounding = _means()
    return float(d.mean()), float(d.mean() - rounding), float(d.mean() + rounding)


def _between() -> float:
    """Sum of squares of differences that the trajectories' means alone make, least."""
    d, rounding = _means()
    deviations = np.abs(d - d.mean())
    # Rounding moves a mean by at most this, and its deviation by 4/3 of that.
    least = np.maximum(deviations - 4 / 3 * rounding, 0.0)
    return PAPER.subjects * float(np.sum(least**2))


def spread_range() -> tuple[float, float]:
    """Least and most standard deviation of the pooled differences.

    Least: subjects do not differ within a trajectory. Most: the conditions are
    perfectly negatively correlated over subjects, so that deviations add up (rounded
    figures at their upper ends).
    """
    d, rounding = _means()
    n, k = PAPER.subjects, len(PAPER.trajectories)
    low = _between() / (n * k - 1)
    within = [
        (n - 1) * (a[1].high + b[1].high) ** 2
        for a, b in zip(PAPER.ikns, PAPER.gamepad, strict=True)
    ]
    most = np.abs(d - d.mean()) + 4 / 3 * rounding
    high = (sum(within) + n * float(np.sum(most**2))) / (n * k - 1)
    return math.sqrt(low), math.sqrt(high)


def standard_error() -> tuple[float, float]:
    """Of the mean pooled difference: as printed p implies, and at worst by rounding."""
    d, low, high = difference_range()
    df = PAPER.degrees
    best = abs(d) / float(stats.t.isf(PAPER.p.value / 2, df))
    worst = max(abs(low), abs(high)) / float(stats.t.isf(PAPER.p.high / 2, df))
    return best, min(worst, spread_range()[1] / math.sqrt(df + 1))


def tost_p(margin: float, difference: float, error: float, degrees: int) -> float:
    """Larger p of the two one-sided t-tests, from summary numbers."""
    return float(stats.t.sf((margin - abs(difference)) / error, degrees))
