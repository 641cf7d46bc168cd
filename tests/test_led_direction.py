"""Laws of the direction that the wrist has led."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns.errors import InvalidInput
from ikns.nullspace.led_direction import LEASH, led_direction
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import IntentMap


def path(seed, n=60, *, step=0.02):
    """A wrist that wanders, and a hand that points anywhere."""
    rng = np.random.default_rng(seed)
    wrist = np.cumsum(rng.normal(scale=step, size=(n, 3)), axis=0)
    way = rng.normal(size=(n, 3))
    return np.hstack([wrist, way / np.linalg.norm(way, axis=1, keepdims=True)])


@given(st.integers(0, 999))
@settings(max_examples=20, deadline=None)
def test_a_hand_that_turns_where_it_is_counts_as_it_was(seed):
    x = path(seed, step=0.0)
    x[:, :3] += np.random.default_rng(seed).uniform(-0.01, 0.01, (60, 3))
    # From corner to corner of this box is less than the leash.
    assert np.linalg.norm([0.02] * 3) / 2 < LEASH
    x[0, :3] = 0
    np.testing.assert_array_equal(led_direction(x)[:, 3:], np.tile(x[0, 3:], (60, 1)))


@given(st.integers(0, 999), st.integers(1, 40), st.floats(0.03, 0.5))
@settings(max_examples=20, deadline=None)
def test_a_straight_way_counts_by_its_length_however_often_it_is_seen(seed, n, far):
    first, last = path(seed, 2)
    first[:3], last[:3] = 0, far * last[3:]
    share = np.linspace(0, 1, n + 1)[1:, None]
    between = np.hstack([share * last[:3], np.tile(last[3:], (n, 1))])
    led = led_direction(np.vstack([first, between]))[-1, 3:]
    left = np.exp(-(far - LEASH) / LEASH)
    expected = last[3:] + left * (first[3:] - last[3:])
    np.testing.assert_allclose(led, expected, rtol=0, atol=1e-12)


@given(st.integers(0, 999))
@settings(max_examples=20, deadline=None)
def test_frames_seen_again_or_missing_change_nothing(seed):
    x = path(seed)
    led = led_direction(x)
    again = led_direction(np.repeat(x, 3, axis=0))
    # A dragged anchor is a leash away, but for rounding.
    np.testing.assert_allclose(again[2::3], led, rtol=0, atol=1e-12)
    gaps = np.insert(x, [3, 3, 20], np.nan, axis=0)
    known = np.isfinite(gaps).all(axis=1)
    np.testing.assert_array_equal(led_direction(gaps)[known], led)
    assert (np.linalg.norm(led[:, 3:], axis=1) <= 1 + 1e-12).all()


@given(st.integers(0, 999))
@settings(max_examples=20, deadline=None)
def test_it_turns_and_moves_with_the_frame(seed):
    x, turn = path(seed), Rotation.random(random_state=seed).as_matrix()

    def seen(rows):
        return np.hstack([rows[:, :3] @ turn.T + [0.1, -2, 3], rows[:, 3:] @ turn.T])

    np.testing.assert_allclose(
        led_direction(seen(x))[:, 3:], led_direction(x)[:, 3:] @ turn.T, atol=1e-10
    )


def test_without_a_leash_the_hand_counts_as_it_is():
    x = path(3)
    np.testing.assert_array_equal(led_direction(x, 0.0), x)
    with pytest.raises(InvalidInput, match="places"):
        led_direction(x[:, :3])
    with pytest.raises(InvalidInput, match=r"leash of 0 m or more, found -0\.1"):
        IntentMap.from_arrays(
            NaturalPosture.of_people(), np.zeros((1, 3)), [0.0], [1.0], leash=-0.1
        )
