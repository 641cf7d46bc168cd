"""Block bootstrap against closed forms: its own variance, AR(1), noncentral chi-square.

Numbers of draws are such that the tolerances below are three to five standard errors.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.stats import ncx2
from scipy.stats import t as student

from ikns.errors import InvalidInput, NotEnoughData
from ikns.numerics.bootstrap import (
    block_counts,
    block_rows,
    blocks_for,
    length_estimate,
    length_interval,
    student_interval,
)


def ar1(rng, n, phi, m=1):
    x = np.zeros((n + 200, m))
    noise = rng.normal(size=x.shape)
    for i in range(1, len(x)):
        x[i] = phi * x[i - 1] + noise[i]
    return x[200:]


@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32))
def test_a_drawn_series_is_made_of_whole_blocks(n, length, seed):
    length = min(length, n)
    rows = block_rows(n, length, 3, np.random.default_rng(seed))
    assert rows.shape == (3, n)
    step = np.diff(rows, axis=1) % n
    inside = (np.arange(1, n) % length) != 0
    assert (step[:, inside] == 1 % n).all()
    counts = block_counts(n, length, 3, np.random.default_rng(seed))
    assert (counts == [np.bincount(row, minlength=n) for row in rows]).all()


def test_the_variance_of_a_mean_is_that_of_the_means_of_all_circular_blocks():
    rng = np.random.default_rng(1)
    n, length = 60, 12
    x = ar1(rng, n, 0.8)[:, 0]
    blocks = np.stack([np.roll(x, -i)[:length] for i in range(n)]).mean(axis=1)
    exact = blocks.var() / (n / length)
    drawn = (block_counts(n, length, 20000, rng) @ x / n).var()
    # A variance of 20000 draws, close to normal, has a standard error of 1 %.
    assert drawn == pytest.approx(exact, rel=0.04)


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.8])
def test_the_variance_of_the_mean_of_an_autoregression_is_found(phi):
    rng = np.random.default_rng(2)
    n, found, degrees = 4000, [], []
    for _ in range(30):
        x = ar1(rng, n, phi)[:, 0]
        length, count = blocks_for(x)
        means = block_counts(n, length, 200, rng) @ x / n
        found.append(n * means.var())
        degrees.append(1.5 * count)
    exact = 1 / (1 - phi) ** 2
    # Blocks cost about a fortieth (here a little more or less, since the length is
    # estimated); each estimate scatters by sqrt(2 / degrees), from 200 draws by 10 %.
    scatter = np.sqrt((2 / np.mean(degrees) + 0.01) / 30)
    assert -0.15 - 4 * scatter < np.mean(found) / exact - 1 < 0.02 + 4 * scatter


def test_blocks_grow_with_correlation_and_not_with_scale():
    rng = np.random.default_rng(3)
    lengths = [
        np.mean([blocks_for(ar1(rng, 2000, phi)).length for _ in range(10)])
        for phi in (0.0, 0.5, 0.9)
    ]
    assert lengths[0] < 12
    # G / g(0) of an autoregression is 2 phi / (1 - phi^2): 1.33 and 9.5 samples.
    assert lengths[1] == pytest.approx(53.3, rel=0.4)
    assert lengths[2] == pytest.approx(379, rel=0.4)
    x = ar1(rng, 500, 0.9)
    assert blocks_for(1e3 * x - 7) == blocks_for(x)
    assert blocks_for(np.ones(50)) == (1, 50)


def test_the_length_for_a_long_series_is_the_one_of_the_formula():
    rng, phi = np.random.default_rng(4), 0.5
    lengths = [blocks_for(ar1(rng, 20_000, phi)).length for _ in range(12)]
    # One length scatters by 5.5 %: four standard errors of the mean. A window without
    # a flat top would shorten it by 16 %.
    assert np.mean(lengths) == pytest.approx(80 * phi / (1 - phi**2), rel=0.065)


@pytest.mark.parametrize(
    ("blocks", "critical"),
    # Kiefer and Vogelsang 2005, Bartlett, 97.5 %:
    # 1.96 + 2.9694 b + 0.4160 b^2 - 0.5324 b^3 at b = 1 / blocks.
    [(k, 1.96 + 2.9694 / k + 0.416 / k**2 - 0.5324 / k**3) for k in (3, 4, 6, 10, 50)],
)
def test_few_blocks_are_allowed_for_as_the_asymptotics_ask(blocks, critical):
    replicates = np.array([-1.0, 1.0]) / np.sqrt(2)  # standard deviation 1
    low, high = student_interval(0.0, replicates, blocks)
    assert low == -high
    # 7 %: an approximation by Student's distribution.
    assert high == pytest.approx(critical, rel=0.07)


def test_with_many_blocks_the_interval_is_the_textbook_one():
    values = np.random.default_rng(4).normal(size=5000)
    low, high = student_interval(1.0, values, 1e9)
    half = 1.959964 * values.std(ddof=1)
    np.testing.assert_allclose([low, high], [1 - half, 1 + half], rtol=1e-6)


@pytest.mark.parametrize("found", [0.5, 1.5, 2.5, 5.0, 20.0])
def test_the_interval_of_a_length_inverts_the_noncentral_chi_square(found):
    rng = np.random.default_rng(5)
    vector = found * np.array([0.6, 0.0, 0.8])
    replicates = vector + rng.normal(size=(200_000, 3))
    low, high = length_interval(vector, replicates, 1e9, rng=rng)

    def exact(share):
        def excess(r):
            return ncx2.cdf(found**2, 3, max(r, 1e-12) ** 2) - share

        return brentq(excess, 0, found + 6) if excess(0) > 0 else 0.0

    # Quantiles at 2.5 % of 200000 draws: density 0.06, standard error 0.006.
    assert low == pytest.approx(exact(0.975), abs=0.03)
    # Less than noise alone would make half of the time has the end of that.
    found = max(found, np.sqrt(ncx2.ppf(0.5, 3, 0)))
    assert high == pytest.approx(exact(0.025), abs=0.03)


@given(st.integers(0, 2**32 - 1), st.floats(0, 5), st.floats(1, 100))
def test_a_corrected_length_lies_in_its_interval_which_is_never_empty(
    seed, found, blocks
):
    rng = np.random.default_rng(seed)
    vector = found * np.array([0.6, 0.0, 0.8])
    replicates = vector + rng.normal(size=(50, 3))
    estimate = length_estimate(vector, replicates, blocks, rng=rng)
    assert 0 <= estimate.low <= estimate.corrected <= estimate.high
    assert estimate.high > 0
    assert estimate.corrected <= found * (1 + 1e-12)


def test_a_corrected_length_is_as_often_too_long_as_too_short():
    rng = np.random.default_rng(9)
    true, longer = np.array([1.5, 0.0, 0.0]), 0
    for _ in range(400):
        found = true + rng.normal(size=3)
        replicates = found + rng.normal(size=(300, 3))
        corrected, _, _ = length_estimate(found, replicates, 1e9, rng=rng)
        longer += corrected > 1.5
    # 400 draws of one half scatter by 0.025; three times that, and 0.03 as the errors
    # are taken along what was found instead of along the truth.
    assert longer / 400 == pytest.approx(0.5, abs=0.075 + 0.03)


def test_intervals_hold_the_mean_of_an_autoregression_as_often_as_they_say():
    rng = np.random.default_rng(6)
    n, trials, phi = 400, 300, 0.6
    mean = np.array([0.2, 0.0, 0.1])
    hit = np.zeros(2)
    for _ in range(trials):
        x = mean + ar1(rng, n, phi, 3)
        length, count = blocks_for(x)
        drawn = block_counts(n, length, 200, rng) @ x / n
        found = x.mean(axis=0)
        low, high = student_interval(found[0], drawn[:, 0], count)
        hit[0] += low <= mean[0] <= high
        low, high = length_interval(found, drawn, count, rng=rng)
        hit[1] += low <= np.linalg.norm(mean) <= high
    # 95 % less 2.5 % that correlated series cost; 300 trials scatter by 1.4 %.
    assert (hit / trials > 0.925 - 3 * 0.015).all()
    assert (hit / trials < 0.95 + 3 * 0.0126).all()


@pytest.mark.parametrize(
    ("n", "share"), [(250, 0.04), (250, 0.15), (1000, 0.08), (250, 0.3)]
)
def test_intervals_hold_their_level_with_slow_drift(n, share):
    # Noise on a drift whose memory (to 1/e) is a share of the whole series. With blocks
    # of a third at most, sought within 2 sqrt(n) lags, it was 0.87, 0.82 and 0.82; with
    # blocks that lose a twentieth of the variance 0.93, 0.90 and 0.92. The last was
    # 0.90 while a series counted for 1.25 blocks at least.
    rng = np.random.default_rng(11)
    phi, trials, hit = np.exp(-1 / (share * n)), 300, 0
    for _ in range(trials):
        drift = ar1(rng, n, phi, 1)[:, 0] * np.sqrt(1 - phi**2)
        x = drift + 0.5 * rng.normal(size=n)
        length, count = blocks_for(x)
        drawn = block_counts(n, length, 100, rng) @ x / n
        low, high = student_interval(x.mean(), drawn, count)
        hit += low <= 0 <= high
    # 300 trials scatter by 1.3 %, three times that.
    assert hit / trials > 0.95 - 3 * 0.0126


def test_replicates_that_do_not_exist_are_left_out():
    rng = np.random.default_rng(7)
    values = np.r_[rng.normal(size=100), np.nan]
    assert student_interval(0.0, values, 10) == student_interval(0.0, values[:-1], 10)
    assert np.isnan(student_interval(0.0, [np.nan], 10)).all()
    assert np.isnan(length_interval([1.0], [[np.nan]], 10, rng=rng)).all()
    assert np.isnan(student_interval(np.nan, values, 10)).all()


def test_a_wider_level_needs_a_wider_interval():
    values = np.random.default_rng(8).normal(size=1000)
    half = [student_interval(0.0, values, 5, level=p)[1] for p in (0.8, 0.95)]
    # 5 blocks: 7.5 degrees of freedom.
    ratio = student.ppf(0.975, 7.5) / student.ppf(0.9, 7.5)
    assert half[1] / half[0] == pytest.approx(ratio)


def test_too_few_samples_and_impossible_blocks_are_refused():
    with pytest.raises(NotEnoughData, match="at least 6 samples"):
        blocks_for(np.zeros(5))
    for length in (0, 8):
        with pytest.raises(InvalidInput, match="1 to 7 rows"):
            block_rows(7, length, 2, np.random.default_rng(0))
