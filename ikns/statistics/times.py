"""Times to success with a limit, including failed trials.

A trial that fails, by a drop or by time-out, is censored at the limit: the object was
not placed within it, however early it fell. Censoring at the drop would imply that it
might have been placed a moment later. Leaving failures out, as the paper did, favors
the condition that fails more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from ikns.errors import InvalidInput, NotEnoughData
from ikns.output.wording import interval_text, number, p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.paired_tests import PairedT, subject_means_t
from ikns.statistics.pairs import Pairs, pair_trials
from ikns.statistics.success import success_pairs
from ikns.statistics.table import Table, column, finite_values, numbers


@dataclass(frozen=True)
class TimeTest:
    """Time to success of two conditions, failures included.

    Parameters
    ----------
    restricted_means : (float, float)
        Mean time to success up to the limit, s.
    over_subjects : PairedT or None
        Of the restricted times, one pair a person; None without spread.
    chi2, p : float
        Log-rank test stratified by pair (which of the two was done first), 1 degree;
        counts pairs as independent. NaN and 1 when no pair is informative.
    p_exact : float
        The same question, binomial.
    first_sooner, second_sooner : int
        Pairs in which the one was done before the other.
    survivors : (float, float)
        Means of pairs that succeeded twice, as the paper took them, s; NaN with none.
    failed_pairs : int
        Pairs that this leaves out.
    """

    restricted_means: tuple[float, float]
    over_subjects: PairedT | None
    chi2: float
    p: float
    p_exact: float
    first_sooner: int
    second_sooner: int
    survivors: tuple[float, float]
    failed_pairs: int
    limit: float
    pairs: int
    subjects: int
    names: tuple[str, str]

    def sentence(self) -> str:
        """Return the result as a sentence."""
        a, b = self.restricted_means
        parts = [
            f"Mean time to success within {number(self.limit, 's')}, failures counted "
            f"at the limit: {number(a, 's')} with {self.names[0]}, {number(b, 's')} "
            f"with {self.names[1]}"
        ]
        if self.over_subjects is not None:
            t = self.over_subjects
            shown = "differs" if t.p < 0.05 else "is not shown to differ"
            parts[0] += (
                f", which {shown} over {t.subjects} subjects (difference "
                f"{number(t.difference, 's')}, {interval_text(t.low, t.high)}, "
                f"{p_text(t.p)})"
            )
        parts.append(
            f"{self.names[0]} was done first in {self.first_sooner} pairs and "
            f"{self.names[1]} in {self.second_sooner} (log-rank stratified by pair "
            f"{p_text(self.p)}, exact {p_text(self.p_exact)})"
        )
        if self.failed_pairs:
            c, d = self.survivors
            left = (
                f"would leave a difference of {number(c - d, 's')} instead of "
                f"{number(a - b, 's')}"
                if math.isfinite(c - d)
                else "would leave none"
            )
            parts.append(
                f"leaving out the {self.failed_pairs} of {self.pairs} pairs with a "
                f"failure {left}, and favors the condition that fails more"
            )
        return "; ".join(parts) + "."


def restricted_mean(times: np.ndarray, success: np.ndarray, limit: float) -> float:
    """Area under the Kaplan-Meier curve up to the limit, s.

    Parameters
    ----------
    times : (n,) array
        Of success, or of censoring, s.
    success : (n,) bool array
    limit : float
        s.

    Examples
    --------
    >>> restricted_mean(np.array([4.0, 8.0, 20.0]), np.array([1, 1, 0]) == 1, 20.0)
    10.666666666666666
    """
    data = stats.CensoredData.right_censored(times, ~success)
    if not success.any():
        return float(limit)  # scipy has no curve without an event
    curve = stats.ecdf(data).sf
    steps = np.concatenate([[0.0], np.minimum(curve.quantiles, limit), [limit]])
    heights = np.concatenate([[1.0], curve.probabilities])
    return float(np.sum(heights * np.diff(steps)))


def restricted_pairs(
    table: Table,
    *,
    limit: float,
    level: str | None = "object",
    conditions: Sequence[str] | None = None,
    unequal: Literal["refuse", "keep"] = "refuse",
) -> Pairs:
    """Pairs of times, failures at the limit, s. As :func:`time_test`."""
    if not (math.isfinite(limit) and limit > 0):
        raise InvalidInput(f"expected a time limit above 0 s, found {limit:g}.")
    good = np.asarray(column(table, "success"), dtype=bool)
    raw = np.where(good, numbers(column(table, "time"), "time"), limit)
    finite_values(raw, "time of successful trials")
    if np.any((raw < 0) | (raw > limit)):
        bad = raw[(raw < 0) | (raw > limit)][0]
        raise InvalidInput(
            f"expected times of successful trials of 0 to {limit:g} s, found {bad:g}."
        )
    columns = {**table, "time": raw}
    return pair_trials(
        columns, "time", level=level, conditions=conditions, unit="s", unequal=unequal
    )


def time_test(
    table: Table,
    *,
    limit: float,
    level: str | None = "object",
    conditions: Sequence[str] | None = None,
    unequal: Literal["refuse", "keep"] = "refuse",
) -> TimeTest:
    """Compare times to success with failures counted at the limit.

    Parameters
    ----------
    table : mapping of columns
        With ``subject``, ``condition``, the level, time in s and success; one trial per
        subject, condition and level. The time of a failed trial may be missing (NaN).
    limit : float
        Time limit of a trial, s.
    level, conditions, unequal
        As in :func:`pair_trials`.

    Raises
    ------
    InvalidInput
        For a limit that is not above 0, or a success later than the limit or before 0.
    NotEnoughData
        When every trial failed.
    """
    done = success_pairs(table, level=level, conditions=conditions, unequal=unequal)
    pairs = restricted_pairs(
        table, limit=limit, level=level, conditions=done.names, unequal=unequal
    )
    a, b = done.first == 1, done.second == 1
    if not (a | b).any():
        raise NotEnoughData(
            f"expected a successful trial to compare times, found none of {2 * len(a)}."
        )
    d = pairs.differences  # at the limit itself, a success comes before a failure
    sooner = (
        int(np.sum((d < 0) | ((d == 0) & a & ~b))),
        int(np.sum((d > 0) | ((d == 0) & b & ~a))),
    )
    chi2, p, exact = math.nan, 1.0, 1.0
    if sum(sooner):
        n = len(a)
        chi2, p = statsmodels("duration.survfunc").survdiff(
            np.concatenate([pairs.first, pairs.second]),
            np.concatenate([a, b]).astype(int),
            np.repeat([0, 1], n),
            strata=np.tile(np.arange(n), 2),
        )
        exact = float(stats.binomtest(sooner[0], sum(sooner)).pvalue)
    try:
        over_subjects = subject_means_t(pairs)
    except NotEnoughData:
        over_subjects = None
    both = a & b
    survivors = (
        (float(pairs.first[both].mean()), float(pairs.second[both].mean()))
        if both.any()
        else (math.nan, math.nan)
    )
    return TimeTest(
        (
            restricted_mean(pairs.first, a, limit),
            restricted_mean(pairs.second, b, limit),
        ),
        over_subjects,
        float(chi2),
        float(p),
        exact,
        *sooner,
        survivors,
        int(np.sum(~both)),
        float(limit),
        len(a),
        pairs.subject_count,
        pairs.names,
    )
