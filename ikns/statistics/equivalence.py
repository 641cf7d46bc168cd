"""Equivalence within a margin that was declared before the data were seen.

Two one-sided t-tests (Schuirmann 1987, J Pharmacokinet Biopharm 15:657), by
statsmodels. A difference that is not significant does not show equivalence; this test
can.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from scipy import stats

from ikns.errors import InvalidInput
from ikns.output.wording import interval_text, number, p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.pairs import Pairs

Verdict = Literal["equivalent", "equivalent though different", "different", "undecided"]


@dataclass(frozen=True)
class Equivalence:
    """Two one-sided tests and the test of a difference, over subject means.

    Parameters
    ----------
    margin : float
        Declared beforehand, in ``unit``.
    difference : float
        Mean of first minus second, in ``unit``.
    low, high : float
        Interval with confidence 1 - 2 alpha: inside the margin exactly when both
        one-sided tests reject.
    p, p_difference : float
        The larger of the two one-sided; of the two-sided test of a difference.
    """

    margin: float
    alpha: float
    difference: float
    low: float
    high: float
    p: float
    p_difference: float
    degrees: int
    verdict: Verdict
    names: tuple[str, str]
    quantity: str
    unit: str

    def sentence(self) -> str:
        """Return the result as a sentence; undecided stays undecided."""
        a, b = self.names
        margin = number(self.margin, self.unit)
        what = {
            "equivalent": f"{a} and {b} are equivalent within {margin}",
            "equivalent though different": f"{a} and {b} differ, by less than {margin}",
            "different": f"{a} and {b} differ, and equivalence within {margin} is not "
            "shown",
            "undecided": f"these data show neither a difference between {a} and {b} "
            f"nor equivalence within {margin}",
        }[self.verdict]
        return (
            f"{self.quantity}: {what} (mean difference "
            f"{number(self.difference, self.unit)}, "
            f"{interval_text(self.low, self.high, level=1 - 2 * self.alpha)}, two "
            f"one-sided tests over {self.degrees + 1} subjects {p_text(self.p)}, "
            f"difference {p_text(self.p_difference)})."
        )


def checked_margin(margin: float) -> float:
    """Return the margin, or refuse one that is not a positive number."""
    if not (math.isfinite(margin) and margin > 0):
        raise InvalidInput(f"expected a margin above 0, found {margin:g}.")
    return float(margin)


def equivalence(pairs: Pairs, *, margin: float, alpha: float = 0.05) -> Equivalence:
    """Test that the mean difference lies within the margin, over subject means.

    Parameters
    ----------
    pairs : Pairs
    margin : float
        In the unit of the pairs; a number chosen after looking at them proves nothing.
    alpha : float
        In (0, 0.5).

    Raises
    ------
    InvalidInput
        For a margin that is not above 0, or alpha outside.
    NotEnoughData
        With fewer than 2 subjects or differences that are all the same.
    """
    margin = checked_margin(margin)
    if not 0 < alpha < 0.5:
        raise InvalidInput(f"alpha must be between 0 and 0.5, found {alpha:g}.")
    means = pairs.subject_means()
    d = means.need_spread()
    p, _, _ = statsmodels("stats.weightstats").ttost_paired(
        means.first, means.second, -margin, margin
    )
    test = stats.ttest_rel(means.first, means.second)
    interval = test.confidence_interval(1 - 2 * alpha)
    same, other = p < alpha, test.pvalue < alpha
    verdict: Verdict = (
        ("equivalent though different" if other else "equivalent")
        if same
        else ("different" if other else "undecided")
    )
    return Equivalence(
        margin=margin,
        alpha=alpha,
        difference=float(d.mean()),
        low=float(interval.low),
        high=float(interval.high),
        p=float(p),
        p_difference=float(test.pvalue),
        degrees=int(test.df),
        verdict=verdict,
        names=pairs.names,
        quantity=pairs.quantity,
        unit=pairs.unit,
    )
