"""The paper's figures of the tracking experiment, examined again."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from ikns.output.wording import p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.paper import subject_spread_limit
from paper.finding import Finding
from paper.printed import PAPER
from paper.spread import (
    MARGINS,
    difference_range,
    spread_range,
    standard_error,
    tost_p,
)

__all__ = ["examine_tracking"]


def examine_tracking() -> list[Finding]:
    """All findings about tracking."""
    return [
        *_t_and_p(),
        *_spread(),
        *_independence(),
        *_equivalence(),
        *_trajectories(),
        *_absolute_error(),
    ]


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
