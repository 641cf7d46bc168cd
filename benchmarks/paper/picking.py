"""The paper's figures of its participants and of pick and place, examined again."""

from __future__ import annotations

import math

from scipy import stats

from ikns.output.wording import number
from ikns.statistics.library import statsmodels
from paper.finding import Finding
from paper.printed import PAPER

__all__ = ["examine_participants", "examine_picking"]


def examine_participants() -> list[Finding]:
    """All findings about participants."""
    return _age()


def examine_picking() -> list[Finding]:
    """All findings about pick and place."""
    return [*_objects(), *_success(), *_times()]


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
    # Most: everyone at one of the ends (Bhatia and Davis 2000).
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
            f"{fail} of {n} trials failed with IKNS, none is reported with the ring",
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
