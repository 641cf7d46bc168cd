"""Crosstalk on reaches whose change of c is planted."""

import numpy as np
import pytest

from ikns.analysis.compare import crosstalk, find_reaches
from ikns.errors import InvalidInput, NotEnoughData

RATE = 100


def reaches(goals, *, rest=30, move=80):
    """Minimum-jerk reaches along a line from goal to goal, with rests, (T,)."""
    s = np.arange(1, move + 1) / move
    share = s**3 * (10 - 15 * s + 6 * s**2)
    parts = [np.full(rest, goals[0])]
    for a, b in zip(goals[:-1], goals[1:], strict=True):
        parts += [a + (b - a) * share, np.full(rest, b)]
    return np.concatenate(parts)


def moving(goals):
    x = reaches(goals)
    position = np.stack([x, 0 * x, 0 * x], axis=1)
    return x, np.abs(np.gradient(x) * RATE), position


def test_every_reach_between_rests_is_found_once():
    _, speed, position = moving([0, 0.3, 0.1, 0.4, 0.43])
    found = find_reaches(speed, position)
    # The last, 3 cm, is too short to count.
    assert len(found) == 3
    assert (speed[found] < 0.05).all()
    assert all((speed[a + 1 : b] >= 0.05).all() for a, b in found)
    assert len(find_reaches(speed, position, min_distance=0.01)) == 4


def test_a_reach_that_was_not_seen_is_no_reach():
    _, speed, position = moving([0, 0.3, 0.1])
    speed[60] = np.nan
    assert len(find_reaches(speed, position)) == 1


def test_planted_crosstalk_comes_out():
    goals = np.array([0, 0.3, 0.1, 0.4, 0.0, 0.2, 0.5, 0.1])
    x, speed, position = moving(goals)
    found = crosstalk(2 * x + 0.1, speed, position)
    steps = np.diff(goals)
    # The gate cuts a millimeter off each end: 30 s^2 (1 - s)^2 d / T < 0.05 m/s there.
    np.testing.assert_allclose(found.change, 2 * steps, atol=0.01)
    np.testing.assert_allclose(found.distance, np.abs(steps), atol=0.005)
    np.testing.assert_allclose(found.excursion, 2 * np.abs(steps), atol=0.01)
    # c is a function of the place: exact, and the same in every resample.
    assert found.per_meter == pytest.approx(2)
    np.testing.assert_allclose(found.per_meter_interval, 2)
    assert found.mean_change == pytest.approx(2 * np.abs(steps).mean(), abs=0.01)
    low, high = found.mean_change_interval
    assert low < found.mean_change < high
    assert found.largest == found.excursion.max()


def test_an_excursion_counts_though_c_comes_back():
    x, speed, position = moving([0.0, 0.4])
    found = crosstalk(np.sin(np.pi * x / 0.4), speed, position)
    assert abs(found.change[0]) < 0.02
    assert found.largest == pytest.approx(1, abs=0.02)


def test_intervals_hold_the_mean_of_random_places():
    rng = np.random.default_rng(0)
    # |difference| of two uniform numbers has the mean 1/3.
    hit = 0
    for _ in range(100):
        x, speed, position = moving(rng.uniform(0, 1, 25))
        low, high = crosstalk(
            3 * x, speed, position, min_distance=1e-9, resamples=200
        ).mean_change_interval
        hit += low <= 1 <= high
    # 95 % of 100 trials: standard deviation 2.2, four of them below.
    assert hit >= 86


def test_a_recording_without_reaches_is_reported():
    _, speed, position = moving([0, 0.02])
    with pytest.raises(NotEnoughData, match=r"reaches of 0.05 m or more"):
        crosstalk(speed, speed, position)
    with pytest.raises(InvalidInput, match="one control signal"):
        crosstalk(speed[:-1], speed, position)
    with pytest.raises(InvalidInput, match="gate above 0"):
        find_reaches(speed, position, max_hand_speed=0)
