"""The paper's own figures, examined again from nothing but what it prints.

No raw data are published, so this asks what the printed numbers imply together, within
their rounding. Everything is computed here from :data:`PAPER`; nothing is typed in.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from ikns.experiments.statistics.library import statsmodels
from ikns.experiments.statistics.printed import PAPER
from ikns.experiments.statistics.published_tracking import (
    MARGINS,
    difference_range,
    spread_range,
    standard_error,
    subject_spread_limit,
    tost_p,
)
from ikns.experiments.statistics.wording import number, p_text

__all__ = ["Finding", "paper_reexamined"]


@dataclass(frozen=True)
class Finding:
    """One claim of the paper and what its printed numbers say about it.

    Parameters
    ----------
    claim : str
        As printed, in our words.
    implies : str
        What the printed numbers imply.
    verdict : str
        ``agrees``, ``contradicts itself``, ``takes for granted``, ``not shown``, or
        ``incomplete``.
    values : dict
        The computed numbers by name.
    """

    claim: str
    implies: str
    verdict: str
    values: dict[str, float] = field(repr=False)

    def sentence(self) -> str:
        """Say it."""
        return f"{self.claim}: {self.verdict}, for {self.implies}."


def paper_reexamined() -> tuple[Finding, ...]:
    """All findings, tracking first.

    Examples
    --------
    >>> findings = paper_reexamined()
    >>> findings[0].verdict
    'contradicts itself'
    """
    rows: list[Finding] = []
    for examine in _EXAMINATIONS:
        rows += examine()
    return tuple(rows)


def _t_and_p() -> list[Finding]:
    t, p, df = PAPER.t, PAPER.p, PAPER.degrees
    got = float(2 * stats.t.sf(t.value, df))
    low, high = (float(2 * stats.t.sf(x, df)) for x in (t.high, t.low))
    fits = low <= p.high and high >= p.low
    needed = float(stats.t.isf(p.value / 2, df))
    tenth = t.value / 10
    p_tenth = float(2 * stats.t.sf(tenth, df))
    slip = p.low <= p_tenth <= p.high
    return [
        Finding(
            f"t({df}) = {t.text} with p = {p.text}",
            f"t = {t.text} gives p = {got:.3f} ({low:.3f} to {high:.3f} by rounding)",
            "agrees" if fits else "contradicts itself",
            {"p": got, "p_low": low, "p_high": high},
        ),
        Finding(
            f"p = {p.text}",
            f"it needs t = {needed:.4f}, and a tenth of the printed t gives p = "
            f"{p_tenth:.3f}"
            + (", so a zero was probably lost in print" if slip else ""),
            "agrees" if t.low <= needed <= t.high else "contradicts itself",
            {"t": needed, "p_of_a_tenth": p_tenth},
        ),
    ]


def _spread() -> list[Finding]:
    d, d_low, d_high = difference_range()
    t, p, n = PAPER.t, PAPER.p, PAPER.degrees + 1
    low, high = spread_range()
    by_t = max(abs(d_low), abs(d_high)) * math.sqrt(n) / t.low
    needed = float(stats.t.isf(p.value / 2, PAPER.degrees))
    by_p = abs(d) * math.sqrt(n) / needed
    return [
        Finding(
            f"t = {t.text} with condition means that differ by {d:.4f}",
            f"the {n} differences would have a standard deviation of at most "
            f"{by_t:.2f}, yet the trajectories' means alone spread them by {low:.2f}; "
            f"p = {p.text} would have about {by_p:.2f}, and {low:.2f} to {high:.2f} is "
            "possible",
            "agrees" if by_t >= low else "contradicts itself",
            {"by_t": by_t, "by_p": by_p, "low": low, "high": high, "difference": d},
        )
    ]


def _independence() -> list[Finding]:
    n, k = PAPER.subjects, len(PAPER.trajectories)
    pooled = n * k - 1
    return [
        Finding(
            f"a paired t-test with {PAPER.degrees} degrees of freedom",
            f"{PAPER.degrees} are those of {n} subjects x {k} trajectories counted as "
            f"{n * k} independent pairs, where {n} persons have {n - 1}",
            "takes for granted" if pooled == PAPER.degrees else "contradicts itself",
            {"pooled": float(pooled), "subjects": float(n - 1)},
        )
    ]


def _equivalence() -> list[Finding]:
    d, _, d_high = difference_range()
    best, worst = standard_error()
    df, n = PAPER.degrees, PAPER.subjects
    rows = []
    for margin in MARGINS:
        p, p_worst = tost_p(margin, d, best, df), tost_p(margin, d_high, worst, df)
        holds = "would hold" if p < 0.05 else "would not hold"
        within = (
            "whatever was rounded"
            if (p < 0.05) == (p_worst < 0.05)
            else "but rounding can turn it"
        )
        rows.append(
            Finding(
                "no significant difference, so a performance comparable to the gamepad",
                f"equivalence within {margin:g} {holds}, pooled as printed "
                f"({p_text(p)}, at worst {p_text(p_worst)}: {within}), had that margin "
                "been declared",
                "not shown",
                {"margin": margin, "p": p, "p_worst": p_worst},
            )
        )
    smallest = abs(d) + float(stats.t.isf(0.05, df)) * best
    spread = subject_spread_limit()
    quantile = float(stats.t.isf(0.05, n - 1))
    by_subject = abs(d) + quantile * spread / math.sqrt(n)
    rows.append(
        Finding(
            "the same, over persons",
            f"the smallest margin that passes is {smallest:.2f} pooled; over "
            f"{n} subjects' means it may be as large as {by_subject:.2f}, and their "
            "spread, which would settle it, is not printed",
            "incomplete",
            {"pooled": smallest, "subjects": by_subject, "spread": spread},
        )
    )
    power = statsmodels("stats.power").TTestPower()
    size = float(power.solve_power(nobs=n, alpha=0.05, power=0.8))
    pooled = float(power.solve_power(nobs=df + 1, alpha=0.05, power=0.8))
    sd = best * math.sqrt(df + 1)
    rows.append(
        Finding(
            "no significant difference",
            f"a difference of less than {pooled * sd:.2f} would have been missed more "
            f"than once in five times (pooled; {size * spread:.2f} over subjects, if "
            "they spread as much as they can)",
            "not shown",
            {"pooled": pooled * sd, "subjects": size * spread},
        )
    )
    return rows


def _trajectories() -> list[Finding]:
    n = PAPER.subjects
    rows = []
    for name, (a, sa), (b, sb) in zip(
        PAPER.trajectories, PAPER.ikns, PAPER.gamepad, strict=True
    ):
        test = stats.ttest_ind_from_stats(
            a.value, sa.value, n, b.value, sb.value, n, equal_var=True
        )
        d = a.value - b.value
        # Paired, the spread of differences depends on how the conditions correlate.
        most = abs(d) * math.sqrt(n) / float(stats.t.isf(0.025, n - 1))
        needed = (sa.value**2 + sb.value**2 - most**2) / (2 * sa.value * sb.value)
        side = "smaller" if d < 0 else "larger"
        rows.append(
            Finding(
                f"{name}: RMSE {a.text} +- {sa.text} against {b.text} +- {sb.text}",
                f"IKNS is {side} by {abs(d):.2f} (unpaired t = "
                f"{float(test.statistic):.2f}, p = {float(test.pvalue):.3f}; paired, p "
                f"is below 0.05 when the conditions correlate by {needed:.2f} or more)"
                ", which pooling the trajectories averages out",
                "incomplete",
                {
                    "difference": d,
                    "t": float(test.statistic),
                    "p": float(test.pvalue),
                    "correlation": needed,
                },
            )
        )
    return rows


def _absolute_error() -> list[Finding]:
    limit = PAPER.absolute_error_below
    worst = float(np.mean([a.high for a, _ in PAPER.ikns]))
    return [
        Finding(
            f"mean absolute error below {limit.text} over all trials",
            f"it cannot exceed the mean RMSE, which is at most {worst:.3f}",
            "agrees" if worst <= limit.value else "incomplete",
            {"rmse": worst},
        )
    ]


def _age() -> list[Finding]:
    n, (mean, sd) = PAPER.subjects, PAPER.age
    low, high = float(PAPER.youngest), float(PAPER.oldest)
    any_mean = (high - low) / math.sqrt(2 * (n - 1))
    middle = (low + high) / 2
    nearest = min(max(middle, mean.low), mean.high)
    # Least: one person at each end, all others alike.
    rest = (n * nearest - low - high) / (n - 2)
    squares = (low - nearest) ** 2 + (high - nearest) ** 2
    least = math.sqrt((squares + (n - 2) * (rest - nearest) ** 2) / (n - 1))
    # Most: everybody at one of the ends (Bhatia and Davis 2000).
    most = math.sqrt((high - mean.value) * (mean.value - low) * n / (n - 1))
    as_error = sd.value * math.sqrt(n)
    fits = least <= as_error <= most
    return [
        Finding(
            f"age {mean.text} +- {sd.text}, from {low:g} to {high:g}, {n} subjects",
            f"a standard deviation is at least {any_mean:.2f} with this range and "
            f"{least:.2f} with this mean"
            + (", so it may be a standard error" if fits else ""),
            "agrees" if sd.high >= least else "contradicts itself",
            {
                "least": least,
                "least_any_mean": any_mean,
                "most": most,
                "as_error": as_error,
            },
        )
    ]


def _objects() -> list[Finding]:
    rows, text, n = len(PAPER.objects_in_table), PAPER.objects_in_text, PAPER.subjects
    most = [PAPER.failures_apple + (k - 1) * PAPER.failures_other for k in (text, rows)]
    fits = [PAPER.failures <= m for m in most]
    return [
        Finding(
            f"{text} objects and {PAPER.trials} trials",
            f"the table has {rows} rows, and {n} subjects with {rows} objects make "
            f"{n * rows} trials",
            "agrees" if rows == text else "contradicts itself",
            {"rows": float(rows), "trials": float(n * rows)},
        ),
        Finding(
            f"{PAPER.failures} failures, {PAPER.failures_apple} with the apple, at most"
            f" {PAPER.failures_other} with any other object",
            f"{text} objects allow up to {most[0]} and {rows} up to {most[1]}, which "
            "does not tell how many there were",
            "incomplete" if all(fits) else "contradicts itself",
            {"most_in_text": float(most[0]), "most_in_table": float(most[1])},
        ),
    ]


def _success() -> list[Finding]:
    fail, n = PAPER.failures, PAPER.trials
    mcnemar = statsmodels("stats.contingency_tables").mcnemar
    p = float(mcnemar([[n - fail, 0], [fail, 0]], exact=True).pvalue)
    # The ring's failures that would take the difference away, each in another pair.
    allowed = next(
        k
        for k in range(fail + 1)
        if mcnemar([[n - fail - k, k], [fail, 0]], exact=True).pvalue >= 0.05
    )
    return [
        Finding(
            f"{fail} of {n} trials failed with IKNS, none is told of with the ring",
            f"if the ring had none, success differs (exact McNemar p = {p:.4f}), and "
            f"still does unless it had {allowed} or more",
            "incomplete",
            {"p": p, "allowed": float(allowed)},
        )
    ]


def _times() -> list[Finding]:
    (a, sa), (b, sb) = PAPER.time_ikns, PAPER.time_ring
    d, median = a.value - b.value, PAPER.time_median.value
    low, high = abs(sa.value - sb.value), sa.value + sb.value
    kept = PAPER.trials - PAPER.failures
    needed = next(
        k
        for k in range(kept // 2, kept + 1)
        if stats.binomtest(k, kept).pvalue < PAPER.time_p.value
    )
    counted = (kept * a.value + PAPER.failures * PAPER.time_limit) / PAPER.trials
    return [
        Finding(
            f"mean times {a.text} and {b.text} s, median difference "
            f"{PAPER.time_median.text} s",
            f"the means differ by {d:.2f} s, {(d - median) / high:.2f} to "
            f"{(d - median) / low:.2f} standard deviations of the differences above "
            "their median, if both are of the same pairs: a long tail of slow trials",
            "agrees" if d - median <= high else "contradicts itself",
            {"difference": d, "least": (d - median) / high, "most": (d - median) / low},
        ),
        Finding(
            f"exact sign test p < {PAPER.time_p.text} over pairs without failures",
            f"{kept} pairs need {needed} of one sign, and count as {kept} independent "
            f"observers where there are {PAPER.subjects}",
            "takes for granted",
            {"pairs": float(kept), "needed": float(needed)},
        ),
        Finding(
            f"{a.text} s on average, failed trials left out",
            f"with the {PAPER.failures} failures at the limit of "
            f"{number(PAPER.time_limit, 's')} it is {counted:.2f} s, and the "
            f"difference {counted - b.value:.2f} s instead of {d:.2f} s (if the ring "
            "had no failure)",
            "incomplete",
            {"mean": counted, "difference": counted - b.value},
        ),
    ]


_EXAMINATIONS: tuple[Callable[[], list[Finding]], ...] = (
    _t_and_p,
    _spread,
    _independence,
    _equivalence,
    _trajectories,
    _absolute_error,
    _age,
    _objects,
    _success,
    _times,
)
