"""Trials are cut to their movement and laid over each other in normalized time."""

from dataclasses import replace

import numpy as np
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st

from ikns.analysis.ucm import aligned_angles, movement, normalize_time
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.motion import Motion

TIME = np.arange(200) / 100


def test_a_movement_runs_from_its_first_to_its_last_fast_sample() -> None:
    speed = np.zeros(200)
    speed[30:60] = speed[80:130] = 0.3
    speed[5:10] = 1.0  # 0.04 s from its first to its last sample: a jerk of a marker
    speed[90] = np.nan
    assert movement(TIME, speed) == slice(30, 130)
    assert movement(TIME, speed, min_duration=0.04) == slice(5, 130)
    assert movement(TIME, speed + 0.1) == slice(0, 200)


@pytest.mark.parametrize(
    ("speed", "says"),
    [
        (np.full(200, 0.04), "faster than 0.05 m/s for 0.1 s, .* sample of 0.04 m/s"),
        (np.full(200, np.nan), "no sample with a known hand speed"),
    ],
)
def test_a_hand_that_does_not_move_has_no_movement(speed, says) -> None:
    with pytest.raises(NotEnoughData, match=says):
        movement(TIME, speed)
    with pytest.raises(InvalidInput, match="time and speed"):
        movement(TIME[1:], speed)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(4, 40),
    st.floats(1e-3, 1e3),
    st.sampled_from([("linear", 1), ("cubic", 3)]),
)
def test_what_a_kind_can_follow_it_follows_at_any_pace(
    seed: int, n: int, duration: float, kind: tuple
) -> None:
    name, degree = kind
    rng = np.random.default_rng(seed)
    share = np.r_[0, np.cumsum(rng.uniform(0.2, 1, size=n - 1))]
    share /= share[-1]
    weights = rng.normal(size=(degree + 1, 2))
    curve = np.vander(share, degree + 1) @ weights
    found = normalize_time(curve, 5 + duration * share, samples=17, kind=name)
    wanted = np.vander(np.linspace(0, 1, 17), degree + 1) @ weights
    # Times of size 5 + 1e-3 keep 12 digits of their differences; knots five times
    # closer than others cost the spline's solver little.
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_ends_and_samples_are_met_exactly() -> None:
    values = np.random.default_rng(1).normal(size=(11, 2, 3))
    for kind in ("linear", "cubic"):
        found = normalize_time(values, np.arange(11) * 0.1, samples=21, kind=kind)
        np.testing.assert_allclose(found[::2], values, atol=1e-12)


def test_gaps_stay_gaps() -> None:
    values = np.arange(11.0)
    values[4] = np.nan
    for kind in ("linear", "cubic"):
        found = normalize_time(values, np.arange(11.0), samples=21, kind=kind)
        assert np.flatnonzero(np.isnan(found)).tolist() == [7, 8, 9]
    both = normalize_time(np.stack([values, values * np.nan], 1), np.arange(11.0))
    assert np.isnan(both[:, 1]).all()


@pytest.mark.parametrize(
    ("values", "time", "options", "error"),
    [
        ([1.0, 2.0], [0.0], {}, InvalidInput),
        ([1.0, 2.0], [0.0, 0.0], {}, InvalidInput),
        ([1.0, 2.0], [0.0, 1.0], {"kind": "cosine"}, InvalidInput),
        ([1.0], [0.0], {}, NotEnoughData),
        ([1.0, 2.0], [0.0, 1.0], {"samples": 1}, NotEnoughData),
    ],
)
def test_series_that_cannot_be_resampled_are_refused(
    values, time, options, error
) -> None:
    with pytest.raises(error, match="\\.$"):
        normalize_time(values, time, **options)


def slower(motion: Motion, factor: float) -> Motion:
    """The same movement, filmed at a lower pace."""
    return replace(
        motion,
        time=factor * motion.time,
        hand_velocity_in_thorax=motion.hand_velocity_in_thorax / factor,
    )


def test_a_slower_repetition_of_a_movement_lies_over_it() -> None:
    fast = small_person.protocol().points.truth
    slow = slower(fast, 1.25)
    # As the threshold falls with the pace, onset and offset stay where they were.
    one = aligned_angles([fast], "right_arm", threshold=0.05, samples=31)
    two = aligned_angles([slow], "right_arm", threshold=0.04, samples=31)
    assert one.shape == (1, 31, 18)
    np.testing.assert_allclose(one, two, atol=1e-12)


def test_angles_are_unknown_while_the_chain_is_out_of_sight() -> None:
    truth = small_person.protocol().points.truth
    middle = len(truth.time) // 2
    hand = truth.hand_in_thorax.copy()
    hand[middle] = np.nan
    hidden = replace(truth, hand_in_thorax=hand)
    found = aligned_angles([truth, hidden], "right_arm", samples=1001)
    assert np.isfinite(found[0]).all()
    gap = np.isnan(found[1]).all(axis=1)
    assert gap.any()
    np.testing.assert_array_equal(found[1][~gap], found[0][~gap])
    with pytest.raises(NotEnoughData, match="at least one motion"):
        aligned_angles([], "right_arm")
