"""Success of paired trials: exact McNemar test, over pairs and over subjects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

from ikns.errors import InvalidInput
from ikns.output.wording import p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.pairs import Pairs, pair_trials
from ikns.statistics.table import Table, column, labels


@dataclass(frozen=True)
class SuccessTest:
    """Success of two conditions on the same subjects and objects.

    Parameters
    ----------
    succeeded : (int, int)
        Of ``pairs``, per condition.
    only_first, only_second : int
        Pairs in which only one condition succeeded; only these are informative.
    p : float
        McNemar's, exact, two-sided; counts pairs as independent.
    p_subjects : float
        Sign-flip permutation test of the subjects' differences in success: one value
        per person. 1 with no difference in any subject.
    low, high : float
        95 % interval of the share of one-sided pairs that the first won (Clopper and
        Pearson); 0 and 1 when there is none.
    """

    succeeded: tuple[int, int]
    only_first: int
    only_second: int
    p: float
    p_subjects: float
    low: float
    high: float
    pairs: int
    subjects: int
    names: tuple[str, str]

    def sentence(self) -> str:
        """Return the result as a sentence."""
        shown = "differs" if self.p < 0.05 else "is not shown to differ"
        return (
            f"Success {shown}: {self.succeeded[0]} of {self.pairs} with "
            f"{self.names[0]}, {self.succeeded[1]} with {self.names[1]}, only the one "
            f"in {self.only_first} pairs, only the other in {self.only_second} (exact "
            f"McNemar {p_text(self.p)}, which counts pairs as independent; by subject "
            f"{p_text(self.p_subjects)}, {self.subjects} subjects)."
        )


def success_pairs(
    table: Table,
    *,
    level: str | None = "object",
    conditions: Sequence[str] | None = None,
    unequal: Literal["refuse", "keep"] = "refuse",
) -> Pairs:
    """Pairs of successes, 1 or 0, from a table of trials, one a subject and level.

    Raises
    ------
    InvalidInput
        For values that are not true or false, repeats, or trials without a partner.
    """
    values = column(table, "success")
    plain: list[Any] = values.tolist()
    if not all(item in (0, 1) for item in plain):
        odd = next(item for item in plain if item not in (0, 1))
        raise InvalidInput(f"expected success to be true or false, found {odd!r}.")
    columns = {**table, "success": np.asarray(values, dtype=np.float64)}
    pairs = pair_trials(
        columns, "success", level=level, conditions=conditions, unequal=unequal
    )
    rows = int(np.isin(labels(table, "condition"), pairs.names).sum())
    if rows > 2 * len(pairs.first) + pairs.dropped:
        raise InvalidInput(
            f"expected one trial per subject, condition and {level or 'study'}, found "
            f"{rows} for {2 * len(pairs.first) + pairs.dropped}."
        )
    return pairs


def success_test(pairs: Pairs) -> SuccessTest:
    """Exact McNemar test of pairs of successes, 1 or 0."""
    for values in (pairs.first, pairs.second):
        if not np.isin(values, (0, 1)).all():
            raise InvalidInput("expected successes of 0 or 1, found other values.")
    a, b = pairs.first == 1, pairs.second == 1
    counts = [
        [int(np.sum(a & b)), int(np.sum(a & ~b))],
        [int(np.sum(~a & b)), int(np.sum(~a & ~b))],
    ]
    one, other = counts[0][1], counts[1][0]
    p, p_subjects, low, high = 1.0, 1.0, 0.0, 1.0
    if one + other:
        test = statsmodels("stats.contingency_tables").mcnemar(counts, exact=True)
        p = float(test.pvalue)
        share = stats.binomtest(one, one + other).proportion_ci(method="exact")
        low, high = float(share.low), float(share.high)
    people = np.unique(pairs.subjects)
    d = np.array([pairs.differences[pairs.subjects == who].sum() for who in people])
    if np.any(d):
        p_subjects = float(
            stats.permutation_test(
                (d,),
                lambda x, axis: np.sum(x, axis=axis),
                permutation_type="samples",
                vectorized=True,
                n_resamples=9999,  # up to 13 subjects: all ways, exact
                random_state=np.random.default_rng(0),
            ).pvalue
        )
    return SuccessTest(
        (int(a.sum()), int(b.sum())),
        one,
        other,
        p,
        p_subjects,
        low,
        high,
        len(a),
        len(people),
        pairs.names,
    )
