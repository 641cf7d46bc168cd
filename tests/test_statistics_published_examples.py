"""Our statistics on the examples that scipy and statsmodels publish of theirs.

Beside those of `test_statistics.py`: Darwin's corn for `wilcoxon`, W of the men's
weights for `shapiro`, the clinic data for `ttost_paired`, `AnovaRM` and `mcnemar`.
The figures are printed in the libraries' documentation or in their own tests, most of
them from R; none comes from a run of the library here.
"""

import math

import numpy as np
import pytest

from ikns.statistics import (
    Design,
    Spread,
    cohens_dz,
    exact_sign,
    learning_curves,
    mixed_model,
    normality,
    pair_arrays,
    pooled_t,
    restricted_mean,
    sample_size,
    simulated_power,
    subject_means_t,
    success_test,
    time_test,
)


def test_the_paired_t_is_that_of_scipy_s_example() -> None:
    # scipy/stats/tests/test_stats.py, test_ttest_rel.
    pairs = pair_arrays(np.linspace(1, 100, 100), np.linspace(1.01, 99.989, 100))
    for found in (pooled_t(pairs), subject_means_t(pairs)):
        assert (found.t, found.p) == pytest.approx(
            (0.81248591389165692, 0.41846234511362157), rel=1e-12
        )
        assert found.degrees == 99


def test_the_sign_test_is_that_of_statsmodels_example() -> None:
    # statsmodels/stats/tests/test_descriptivestats.py, from R's SIGN.test; its M is
    # half the difference of the signs.
    x = [7.8, 6.6, 6.5, 7.4, 7.3, 7.0, 6.4, 7.1, 6.7, 7.6, 6.8]
    found = exact_sign(pair_arrays(x, [6.5] * 11))
    assert found.p == pytest.approx(0.02148, abs=5e-6)
    assert (found.positive - found.negative) / 2 == 4
    assert found.ties == 1


def test_normality_is_that_of_scipy_s_examples() -> None:
    # scipy/stats/tests/test_morestats.py, TestShapiro; first from the article.
    first = [0.11, 7.87, 4.61, 10.14, 7.95, 3.14, 0.46, 4.43, 0.21, 4.75, 0.71, 1.52]
    first += [3.24, 0.93, 0.42, 4.97, 9.53, 4.55, 0.47, 6.66]
    second = [1.36, 1.14, 2.92, 2.55, 1.46, 1.06, 5.27, -1.11, 3.48, 1.10, 0.88, -0.51]
    second += [1.46, 0.52, 6.20, 1.69, 0.08, 3.67, 2.81, 3.49]
    for x, w, p, digits in (
        (first, 0.90047299861907959, 0.042089745402336121, 1e-6),
        (second, 0.9590270, 0.52460, 1e-3),
    ):
        found = normality(pair_arrays(x, np.zeros(20)))
        assert found.statistic == pytest.approx(w, abs=1e-6)
        assert found.p == pytest.approx(p, abs=digits)


def test_mcnemar_is_that_of_statsmodels_examples() -> None:
    # statsmodels/stats/tests/test_nonparametric.py, test_mcnemar_exact: both, only the
    # first, only the second, neither.
    for (both, one, other, none), p in (
        ((101, 121, 59, 33), 0.000004),
        ((101, 70, 59, 33), 0.378688),
        ((101, 80, 59, 33), 0.089452),
        ((101, 30, 60, 33), 0.002060),
        ((101, 10, 30, 33), 0.002221),
        ((101, 10, 10, 33), 1.0),
    ):
        a = [1] * (both + one) + [0] * (other + none)
        b = [1] * both + [0] * one + [1] * other + [0] * none
        found = success_test(pair_arrays(a, b))
        assert (found.only_first, found.only_second) == (one, other)
        assert found.p == pytest.approx(p, abs=1e-6)


def test_the_interval_of_dz_is_that_of_statsmodels_noncentral_t() -> None:
    # statsmodels/stats/tests/test_effectsize.py, from R's conf.limits.nct(1.5, 98).
    x = np.random.default_rng(0).normal(size=99)
    x = (x - x.mean()) / x.std(ddof=1) + 1.5 / math.sqrt(99)
    found = cohens_dz(pair_arrays(x, np.zeros(99)))
    assert found.value * math.sqrt(99) == pytest.approx(1.5)
    # R's own tail beyond its upper limit is 0.02499999, printed to eight digits, and
    # scipy's two ways to the distribution agree to 4e-5 (`test_statistics.py`): with a
    # density of 0.06 there, 1e-3 of a limit.
    limits = np.array([found.low, found.high]) * math.sqrt(99)
    np.testing.assert_allclose(limits, [-0.474934, 3.467371], atol=1e-3)


@pytest.mark.parametrize(
    ("effect", "n", "power"),
    # statsmodels/stats/tests/test_power.py, from R's pwr.t.test, two-sided.
    [(1.0, 30, 0.9995636009612725), (0.2, 20, 0.1359562887679666)],
)
def test_simulated_power_is_that_of_statsmodels_examples(effect, n, power) -> None:
    runs = 10_000
    found = simulated_power(
        Design(n, levels=1, repeats=1),
        Spread(1.0),
        difference=effect,
        simulations=runs,
    )
    # Four binomial errors leave 1 in 16000 to the fixed seed.
    assert abs(found.power - power) < 4 * math.sqrt(power * (1 - power) / runs)


def test_the_sample_size_inverts_statsmodels_example() -> None:
    # The same: a power of 0.136 with 20 is first reached with 20.
    found = sample_size(
        Spread(1.0), levels=1, repeats=1, difference=0.2, target=0.1359562887679666
    )
    # One subject more adds 0.005 of power, whose error is 0.0034: four of them are 3.
    assert found.subjects is not None
    assert abs(found.subjects - 20) <= 3


# --- times with a limit ---------------------------------------------------------------

# scipy's example of `ecdf`: fanbelts that broke, and that did not, 1000 miles.
BROKEN, WHOLE = [77, 47, 81, 56, 80], [62, 60, 43, 71, 37]
#: Where the survival function falls, and to what, as printed there.
FALLS = ((47, 0.875), (56, 0.75), (77, 0.5), (80, 0.25), (81, 0.0))


@pytest.mark.parametrize("limit", [40.0, 50.0, 60.0, 78.0, 81.0, 90.0])
def test_the_restricted_mean_is_the_area_under_scipy_s_survival_curve(limit) -> None:
    times = np.array([*BROKEN, *WHOLE], dtype=float)
    broke = np.arange(10) < 5
    # Watching ends at the limit.
    seen = np.minimum(times, limit)
    area, at, height = 0.0, 0.0, 1.0
    for fall, lower in FALLS:
        area += height * (min(fall, limit) - min(at, limit))
        at, height = fall, lower
    found = restricted_mean(seen, broke & (times <= limit), limit)
    assert found == pytest.approx(area, rel=1e-12)


def test_the_log_rank_by_pairs_is_statsmodels_mcnemar_without_correction() -> None:
    # statsmodels/stats/tests/test_contingency_tables.py, 23, 15, 19, 31, from R: with
    # one pair a stratum, who was done first is all that counts, and of the pairs that
    # failed twice or succeeded at one time there is nothing to count.
    first = [5.0] * 23 + [5.0] * 15 + [9.0] * 19 + [20.0] * 31
    second = [5.0] * 23 + [9.0] * 15 + [5.0] * 19 + [20.0] * 31
    n = len(first)
    table = {
        "subject": [*range(n), *range(n)],
        "condition": ["a"] * n + ["b"] * n,
        "time": first + second,
        "success": [t < 20.0 for t in first + second],
    }
    found = time_test(table, limit=20.0, level=None)
    assert (found.first_sooner, found.second_sooner) == (15, 19)
    assert found.p_exact == pytest.approx(0.60759136127308, rel=1e-9)
    # R's mcnemar.test(correct=FALSE), in the results beside it.
    assert found.chi2 == pytest.approx(0.470588235294118, rel=1e-9)
    assert found.p == pytest.approx(0.492716677227088, rel=1e-9)


# --- learning -------------------------------------------------------------------------


def test_the_learning_curve_is_that_of_scipy_s_curve_fit() -> None:
    # The function and the parameters of `curve_fit`'s example, without its noise, which
    # has no seed: 2.5 exp(-1.3 x) + 0.5 at 50 places from 0 to 4.
    x = np.linspace(0, 4, 50)
    table = {
        "subject": ["a"] * 50,
        "trial": np.arange(1, 51),
        "value": 2.5 * np.exp(-1.3 * x) + 0.5,
    }
    found = learning_curves(table, "value")
    assert found.best == "exponential"
    curve = next(c for c in found.curves if c.model == "exponential")
    # The fit ends when a step changes the squares by less than 1e-8 of them or so;
    # parameters then are right to its root.
    assert (curve.gain, 49 / 4 / curve.rate, curve.final) == pytest.approx(
        (2.5, 1.3, 0.5), rel=1e-4
    )


def test_the_mixed_model_has_the_f_of_statsmodels_repeated_measures() -> None:
    # statsmodels/stats/tests/test_anova_rm.py, two factors, from R's ezANOVA: with
    # nothing missing the condition's F is the square of the mixed model's t.
    cells = {
        ("first", "a"): [7, 3, 6, 6, 5, 8, 6, 7],
        ("first", "b"): [7, 11, 9, 11, 10, 10, 11, 11],
        ("first", "c"): [8, 14, 10, 11, 12, 10, 11, 12],
        ("second", "a"): [16, 7, 11, 9, 10, 11, 8, 8],
        ("second", "b"): [16, 10, 13, 10, 10, 14, 11, 12],
        ("second", "c"): [24, 29, 10, 22, 25, 28, 22, 24],
    }
    rows = [
        (who, condition, level, float(value))
        for (condition, level), values in cells.items()
        for who, value in enumerate(values)
    ]
    names = ("subject", "condition", "trajectory", "value")
    table = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    found = mixed_model(table, "value")
    assert found.structure == "random condition per subject"
    assert found.condition is not None
    t = found.condition.estimate / found.condition.error
    # The optimizer stops at a gradient of 1e-5 or so, which leaves 1e-3 of an error.
    assert t**2 == pytest.approx(40.14159, rel=2e-3)
    assert found.condition.p == pytest.approx(3.905263e-04, rel=5e-3)
    assert found.condition.degrees == 7
