"""Paired tests: the paper's own, pooled as it pooled them, and over subject means.

The paper treats a subject's three trajectories (or ten objects) as independent pairs.
They are not, as a person's skill affects all of them. :func:`pooled_t`,
:func:`normality` and :func:`exact_sign` repeat this and state it;
:func:`subject_means_t` has one pair per person. Computed by scipy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ikns.output.wording import counted, interval_text, number, p_text
from ikns.statistics.pairs import Pairs

_POOLED = "as the paper did it, counting {n} pairs of {m} subjects as independent"
_OWN = "over {m} subjects, one pair each"


def _basis(pairs: Pairs) -> str:
    n, m = len(pairs.first), pairs.subject_count
    return (_POOLED if n > m else _OWN).format(n=n, m=m)


@dataclass(frozen=True)
class PairedT:
    """A paired t-test, two-sided.

    Parameters
    ----------
    difference, low, high : float
        Mean of first minus second with its 95 % interval, in ``unit``.
    deviation : float
        Standard deviation of the differences, in ``unit``.
    basis : str
        What counts as independent.
    """

    t: float
    p: float
    degrees: int
    difference: float
    low: float
    high: float
    deviation: float
    pairs: int
    subjects: int
    names: tuple[str, str]
    quantity: str
    unit: str
    basis: str

    def sentence(self) -> str:
        """Return the result as a sentence; not significant is not called equal."""
        shown = "differs" if self.p < 0.05 else "is not shown to differ"
        return (
            f"Paired t-test {self.basis}: {self.quantity} {shown} between "
            f"{self.names[0]} and {self.names[1]} (mean difference "
            f"{number(self.difference, self.unit)}, "
            f"{interval_text(self.low, self.high)}, t({self.degrees}) = "
            f"{number(self.t)}, {p_text(self.p)})."
        )


def pooled_t(pairs: Pairs) -> PairedT:
    """Paired t-test over all pairs, as the paper did it (10 x 3: 29 degrees).

    Raises
    ------
    NotEnoughData
        With fewer than 2 pairs or differences that are all the same.

    Examples
    --------
    >>> from ikns.statistics import pair_arrays
    >>> test = pooled_t(pair_arrays([1.0, 2.0, 4.0], [1.0, 1.0, 1.0]))
    >>> round(test.t, 4), test.degrees
    (1.5119, 2)
    """
    return _paired_t(pairs)


def subject_means_t(pairs: Pairs) -> PairedT:
    """Paired t-test over each person's mean: 10 persons, 9 degrees.

    Raises
    ------
    NotEnoughData
        With fewer than 2 subjects or differences that are all the same.
    """
    return _paired_t(pairs.subject_means())


def _paired_t(pairs: Pairs) -> PairedT:
    d = pairs.need_spread()
    test = stats.ttest_rel(pairs.first, pairs.second)
    interval = test.confidence_interval(0.95)
    return PairedT(
        t=float(test.statistic),
        p=float(test.pvalue),
        degrees=int(test.df),
        difference=float(d.mean()),
        low=float(interval.low),
        high=float(interval.high),
        deviation=float(d.std(ddof=1)),
        pairs=len(d),
        subjects=pairs.subject_count,
        names=pairs.names,
        quantity=pairs.quantity,
        unit=pairs.unit,
        basis=_basis(pairs),
    )


@dataclass(frozen=True)
class Normality:
    """Shapiro and Wilk's test of the differences: statistic, p, how many."""

    statistic: float
    p: float
    pairs: int
    basis: str

    def sentence(self) -> str:
        """Return the result as a sentence; not rejected is not called normal."""
        verdict = (
            "the differences are not normally distributed"
            if self.p < 0.05
            else "nothing speaks against normal differences, which does not show them"
        )
        return (
            f"Shapiro-Wilk {self.basis}: {verdict} (W = {self.statistic:.3f}, "
            f"{p_text(self.p)}, {counted(self.pairs, 'pair')})."
        )


def normality(pairs: Pairs) -> Normality:
    """Shapiro and Wilk's test of the paired differences, as the paper did it.

    Raises
    ------
    NotEnoughData
        With fewer than 3 pairs or differences that are all the same.
    """
    d = pairs.need_spread(3)
    # scipy advises centered data: W does not depend on the mean.
    test = stats.shapiro(d - np.median(d))
    return Normality(float(test.statistic), float(test.pvalue), len(d), _basis(pairs))


@dataclass(frozen=True)
class SignTest:
    """An exact sign test, two-sided, binomial.

    Parameters
    ----------
    positive, negative, ties : int
        Pairs in which the first is larger, smaller, equal; ties are left out.
    median_difference : float
        Median of the differences, ties included, in ``unit``.
    basis : str
        What counts as independent.
    """

    positive: int
    negative: int
    ties: int
    p: float
    median_difference: float
    names: tuple[str, str]
    quantity: str
    unit: str
    basis: str

    def sentence(self) -> str:
        """Return the result as a sentence."""
        n = self.positive + self.negative
        shown = "is shown" if self.p < 0.05 else "is not shown"
        return (
            f"Exact sign test {self.basis}: {self.quantity} is larger with "
            f"{self.names[0]} than with {self.names[1]} in {self.positive} of {n} "
            f"pairs ({counted(self.ties, 'tie')} left out), and a difference {shown} "
            f"(median difference {number(self.median_difference, self.unit)}, "
            f"{p_text(self.p)})."
        )


def exact_sign(pairs: Pairs) -> SignTest:
    """Exact sign test of the paired differences, as the paper did it for times.

    With ties only, p = 1.
    """
    d = pairs.differences
    up, down = int(np.sum(d > 0)), int(np.sum(d < 0))
    p = float(stats.binomtest(up, up + down).pvalue) if up + down else 1.0
    return SignTest(
        up,
        down,
        len(d) - up - down,
        p,
        float(np.median(d)),
        pairs.names,
        pairs.quantity,
        pairs.unit,
        _basis(pairs),
    )


@dataclass(frozen=True)
class RankTest:
    """Wilcoxon's signed-rank test: smaller rank sum, two-sided p, how many pairs."""

    statistic: float
    p: float
    pairs: int
    names: tuple[str, str]
    quantity: str
    basis: str

    def sentence(self) -> str:
        """Return the result as a sentence."""
        shown = "differs" if self.p < 0.05 else "is not shown to differ"
        return (
            f"Wilcoxon's signed-rank test {self.basis}: {self.quantity} {shown} "
            f"between {self.names[0]} and {self.names[1]} (W = {self.statistic:g}, "
            f"{p_text(self.p)}, {counted(self.pairs, 'pair')})."
        )


def signed_rank(pairs: Pairs) -> RankTest:
    """Wilcoxon's signed-rank test of the paired differences.

    Exact up to 50 pairs without ties, as scipy decides.

    Raises
    ------
    NotEnoughData
        With fewer than 2 pairs or differences that are all the same.
    """
    d = pairs.need_spread()
    test = stats.wilcoxon(d)
    return RankTest(
        float(test.statistic),
        float(test.pvalue),
        len(d),
        pairs.names,
        pairs.quantity,
        _basis(pairs),
    )
