"""Laws of the moving parabola: what it leaves exact, and how far it looks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.numerics.derivative import WINDOW, slope

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


def test_a_single_sample_stands_still():
    assert (
        slope(np.ones((1, 2, 3)), np.zeros(1)).tolist() == np.zeros((1, 2, 3)).tolist()
    )
