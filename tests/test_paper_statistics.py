"""What the paper prints, examined by other means than the benchmark uses."""

import math
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize, special, stats
from statsmodels.stats.weightstats import ttost_paired

from ikns.statistics.assumed_spread import paper_spread

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from paper.finding import Finding
from paper.printed import PAPER, Printed
from paper.reexamined import paper_reexamined
from paper.spread import difference_range, spread_range, standard_error

FINDINGS = paper_reexamined()


def finding(start: str) -> Finding:
    """Return the first whose claim starts so."""
    return next(f for f in FINDINGS if f.claim.startswith(start))


def two_sided(t: float, df: int) -> float:
    """Student's tails by the incomplete beta function."""
    return float(special.betainc(df / 2, 0.5, df / (df + t * t)))


def thirty(mean: float, deviation: float) -> np.ndarray:
    """Thirty differences with exactly this mean and standard deviation."""
    x = np.random.default_rng(0).normal(size=30)
    return mean + deviation * (x - x.mean()) / x.std(ddof=1)


def test_a_printed_number_is_what_rounds_to_it() -> None:
    for text, low, high in (("0.979", 0.9785, 0.9795), ("22", 21.5, 22.5)):
        number = Printed(text)
        assert number.value == float(text)
        assert (number.low, number.high) == pytest.approx((low, high), rel=1e-15)


def test_every_claim_has_a_verdict_and_a_sentence() -> None:
    verdicts = {f.verdict for f in FINDINGS}
    assert verdicts == {
        "agrees",
        "contradicts itself",
        "takes for granted",
        "not shown",
        "incomplete",
    }
    for f in FINDINGS:
        assert f.values
        assert all(math.isfinite(v) for v in f.values.values())
        assert f.sentence() == f"{f.claim}: {f.verdict}, for {f.implies}."


def test_t_and_p_do_not_belong_together() -> None:
    f = finding("t(29) = 0.27 with p")
    assert f.values["p"] == pytest.approx(two_sided(0.27, 29), rel=1e-9)
    assert f.verdict == "contradicts itself"
    g = finding("p = 0.979")
    assert two_sided(g.values["t"], 29) == pytest.approx(0.979, abs=1e-9)
    # A lost zero: t = 0.027 rounds to the printed p.
    assert round(two_sided(0.027, 29), 3) == 0.979
    assert "zero" in g.implies


def test_spread_of_differences_has_the_least_and_most_that_data_can_have() -> None:
    rng = np.random.default_rng(1)
    low, high = spread_range()
    d = np.array([3.35 - 4.13, 5.43 - 4.98, 4.50 - 4.15])
    # The trajectories' means alone, without rounding.
    assert np.repeat(d, 10).std(ddof=1) == pytest.approx(low, abs=0.02)
    assert low <= np.repeat(d, 10).std(ddof=1)
    # Data with the printed moments and any correlation stay inside; opposed, they
    # reach the upper end but for rounding.
    found = []
    for r in (-1.0, -0.5, 0.0, 0.5, 1.0):
        columns = []
        for (a, sa), (b, sb) in zip(PAPER.ikns, PAPER.gamepad, strict=True):
            x, e = rng.normal(size=(2, 10))
            x = (x - x.mean()) / x.std(ddof=1)
            e = e - e.mean() - x * (e @ x) / (x @ x)
            y = r * x + math.sqrt(1 - r * r) * e / e.std(ddof=1)
            columns.append(a.value + sa.value * x - b.value - sb.value * y)
        found.append(np.ravel(columns).std(ddof=1))
        assert low < found[-1] < high
    assert found[0] == pytest.approx(high, rel=0.02)
    by_t = finding("t = 0.27 with condition").values["by_t"]
    assert by_t < low
    # The printed t with any mean difference that rounds to the printed means.
    for shift in np.linspace(*difference_range()[1:], 9):
        for t in (0.265, 0.275):
            assert abs(shift) * math.sqrt(30) / t <= by_t + 1e-12


def test_equivalence_of_data_with_the_printed_moments() -> None:
    d, _, _ = difference_range()
    assert d == pytest.approx(np.mean([3.35, 5.43, 4.50]) - np.mean([4.13, 4.98, 4.15]))
    x = thirty(d, standard_error()[0] * math.sqrt(30))
    assert stats.ttest_1samp(x, 0).pvalue == pytest.approx(0.979, abs=1e-9)
    rows = [f for f in FINDINGS if "margin" in f.values]
    assert [f.values["margin"] for f in rows] == [0.25, 0.5, 1.0]
    for f in rows:
        margin = f.values["margin"]
        p = ttost_paired(x, np.zeros(30), -margin, margin)[0]
        assert f.values["p"] == pytest.approx(p, rel=1e-6)
        assert f.values["p_worst"] > f.values["p"]
        assert f.verdict == "not shown"
    smallest = finding("the same, over persons").values["pooled"]
    assert ttost_paired(x, 0 * x, -smallest, smallest)[0] == pytest.approx(0.05)


def test_subjects_spread_at_most_as_a_plan_takes_them_to() -> None:
    values = finding("the same, over persons").values
    assert values["spread"] == paper_spread("tracking").deviation
    # No more than the pooled differences can spread at all.
    assert values["spread"] < spread_range()[1]


def test_trajectories_are_the_t_tests_of_data_with_their_moments() -> None:
    x = np.random.default_rng(3).normal(size=(2, 10))
    x = (x - x.mean(axis=1, keepdims=True)) / x.std(axis=1, ddof=1, keepdims=True)
    u, v = x[0], x[1] - x[0] * (x[1] @ x[0]) / (x[0] @ x[0])
    v /= v.std(ddof=1)
    for name, (a, sa), (b, sb) in zip(
        PAPER.trajectories, PAPER.ikns, PAPER.gamepad, strict=True
    ):
        f = finding(f"{name}:")
        one = a.value + sa.value * x[0]
        test = stats.ttest_ind(one, b.value + sb.value * x[1])
        assert (f.values["t"], f.values["p"]) == pytest.approx(
            (test.statistic, test.pvalue)
        )
        r = f.values["correlation"]
        other = b.value + sb.value * (r * u + math.sqrt(1 - r * r) * v)
        assert stats.ttest_rel(one, other).pvalue == pytest.approx(0.05)
    assert finding("T1").values["difference"] < 0 < finding("T2").values["difference"]


def test_no_ten_ages_have_that_spread() -> None:
    f = finding("age 35")
    # The eight who are neither the youngest nor the oldest, searched for the least.
    least = optimize.minimize(
        lambda x: np.std([22, 57, *x], ddof=1),
        np.linspace(25, 50, 8),
        bounds=[(22, 57)] * 8,
        constraints={
            "type": "ineq",
            "fun": lambda x: 0.5 - abs(np.mean([22, 57, *x]) - 35),
        },
        method="SLSQP",
    )
    assert f.values["least"] == pytest.approx(least.fun, rel=1e-4)
    free = np.std([22, 57] + [39.5] * 8, ddof=1)
    assert f.values["least_any_mean"] == pytest.approx(free)
    assert PAPER.age[1].value < f.values["least_any_mean"] < f.values["least"]
    # A standard error of 4.5 is that of ages one can write down.
    assert f.values["least"] < 4.5 * math.sqrt(10) < f.values["most"]
    assert f.verdict == "contradicts itself"


def test_failures_fit_ten_objects_and_eleven() -> None:
    f = finding("12 failures")
    for objects, most in ((10, "most_in_text"), (11, "most_in_table")):
        sums = {4 + sum(c) for c in product((0, 1), repeat=objects - 1)}
        assert max(sums) == f.values[most]
        assert 12 in sums
    assert finding("10 objects").values["rows"] == 11


def test_success_differs_if_the_ring_never_failed() -> None:
    f = finding("12 of 100 trials")
    assert f.values["p"] == pytest.approx(2 / 2**12)
    k = int(f.values["allowed"])
    for few, below in ((k - 1, True), (k, False)):
        n = 12 + few
        p = 2 * sum(math.comb(n, i) for i in range(few + 1)) / 2**n
        assert (p < 0.05) == below


def test_times_are_skewed_and_failures_are_missing() -> None:
    f = finding("mean times")
    assert f.values["difference"] == pytest.approx(2.60)
    # Mean and median are never farther apart than one standard deviation.
    assert 0 < f.values["least"] < f.values["most"] < 1
    g = finding("exact sign test")
    n, k = int(g.values["pairs"]), int(g.values["needed"])
    for least, below in ((k, True), (k - 1, False)):
        p = 2 * sum(math.comb(n, i) for i in range(least, n + 1)) / 2**n
        assert (p < 0.01) == below
    h = finding("8.94 s on average")
    assert h.values["mean"] == pytest.approx(np.mean([8.94] * 88 + [20.0] * 12))
    assert h.values["difference"] > f.values["difference"]


def test_absolute_error_is_below_the_rmse_it_belongs_to() -> None:
    f = finding("mean absolute error")
    assert f.verdict == "agrees"
    assert f.values["rmse"] == pytest.approx(np.mean([3.355, 5.435, 4.505]))
