"""Laws of the moving parabola: what it leaves exact, and how far it looks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from ikns.numerics.derivative import WINDOW, slope

TIME = np.arange(120) / 100


@given(
    st.integers(0, 10**6), st.floats(0, 0.6), st.floats(-1e6, 1e6), st.integers(0, 2)
)
def test_a_parabola_has_its_slope_whatever_is_hidden(seed, share, garbage, degree):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(degree + 1, 3))
    exact = sum(k * v * TIME[:, None] ** (k - 1) for k, v in enumerate(values) if k)
    path = sum(v * TIME[:, None] ** k for k, v in enumerate(values))
    known = rng.random((120, 3)) >= share
    found = slope(np.where(known, path, garbage), TIME, known)
    assert np.isnan(found[~known]).all()
    counted = np.isfinite(found)
    # Rounding of a fit to values of about 5 over 0.2 s, 1e-15 * 5 / 0.2, through normal
    # equations with a condition of up to 1e4.
    off = np.abs(found - exact)[counted]
    assert off.max(initial=0.0) < 1e-9


def test_what_is_hidden_does_not_touch_the_other_columns_or_other_times():
    rng = np.random.default_rng(0)
    path, known = rng.normal(size=(120, 2)), np.ones((120, 2), dtype=bool)
    known[50:60, 0] = False
    whole, found = slope(path, TIME), slope(path, TIME, known)
    np.testing.assert_array_equal(found[:, 1], whole[:, 1])
    # The window has 21 samples.
    np.testing.assert_array_equal(found[:40, 0], whole[:40, 0])
    np.testing.assert_array_equal(found[70:, 0], whole[70:, 0])
    # The two next to a long gap are too uncertain, see the module.
    assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == list(range(48, 62))


def test_least_squares_over_the_known_samples_says_the_same():
    rng = np.random.default_rng(1)
    path, known = rng.normal(size=120), rng.random(120) > 0.2
    found = slope(path, TIME, known)
    for i in np.flatnonzero(np.isfinite(found)):
        first = min(max(i - 10, 0), 99)
        rows = np.arange(first, first + 21)[known[first : first + 21]]
        fit = np.polynomial.Polynomial.fit(TIME[rows] - TIME[i], path[rows], 2)
        # Rounding: values of 1 over steps of 0.01 s, with a condition of up to 1e4.
        assert found[i] == pytest.approx(fit.convert().coef[1], abs=1e-8)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_few_samples_know_their_neighbors_only(n):
    known = np.ones(n, dtype=bool)
    path = 3.0 * TIME[:n]
    np.testing.assert_allclose(slope(path, TIME[:n], known), 3.0, atol=1e-9)
    known[0] = False
    assert np.isnan(slope(path, TIME[:n], known)[:2]).all()


def test_one_sample_shows_no_speed():
    assert np.isnan(slope(np.zeros((1, 3)), np.zeros(1))).all()


coefficients = st.lists(st.floats(-10, 10), min_size=3, max_size=3)


@given(coefficients, st.floats(20, 1000), st.integers(2, 200), st.floats(-100, 100))
def test_a_parabola_has_its_own_slope_and_a_line_at_any_rate(abc, rate, n, start):
    a, b, c = abc
    time = start + np.arange(n) / rate
    s = time - start
    # Values up to 10 (1 + T + T^2), rounded, over steps of 1 / rate; times from 100 s
    # know their step to 3e-14 s.
    size = 10 * (1 + s[-1] + s[-1] ** 2)
    rounding = 1e-13 * size * rate + 3e-14 * rate * size
    line = slope(np.stack([b * s + c, c - b * s], axis=1), time)
    assert np.abs(line - [b, -b]).max() <= rounding
    if n >= 5 and round(WINDOW * rate / 2) >= 2:
        assert np.abs(slope(a * s**2 + b * s + c, time) - 2 * a * s - b).max() <= (
            50 * rounding
        )


@pytest.mark.parametrize("rate", [50, 100, 120, 200, 333])
def test_a_sample_is_seen_within_half_the_window_and_not_beyond(rate):
    n = 401
    time, spike = np.arange(n) / rate, np.zeros(n)
    spike[200] = 1.0
    half = round(WINDOW * rate / 2)
    k = np.arange(n) - 200
    # Least squares: k / sum of k^2 over the window, per step, to the other side.
    expected = np.where(np.abs(k) <= half, -k, 0) * rate
    expected = expected / (half * (half + 1) * (2 * half + 1) / 3)
    np.testing.assert_allclose(slope(spike, time), expected, rtol=0, atol=1e-12 * rate)


@given(st.integers(0, 10**6), st.integers(5, 90), st.integers(1, 4))
def test_it_is_the_filter_of_savitzky_and_golay(seed, samples, columns):
    values = np.random.default_rng(seed).normal(size=(samples, columns))
    window = min(21, samples - 1 + samples % 2)
    expected = savgol_filter(values, window, 2, deriv=1, delta=0.01, axis=0)
    # Sums of 21 rounded products of values of about 3 over 0.01 s.
    np.testing.assert_allclose(slope(values, TIME[:samples]), expected, atol=1e-9)
