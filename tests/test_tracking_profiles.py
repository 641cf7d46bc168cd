"""Profiles and schedules of the tracking experiment: their laws, whatever the seed."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.experiments.tracking import CHARACTERS, draw_profile, schedule, williams

seeds = st.integers(0, 2**63 - 1)
names = st.sampled_from(sorted(CHARACTERS))
FINE = np.arange(0.0, 25.0, 1e-3)


@given(seeds)
@settings(max_examples=40)
def test_t1_is_slow_t2_holds_the_fall_and_t3_lies_between(seed):
    peak = {n: np.abs(draw_profile(n, seed).speed(FINE)).max() for n in CHARACTERS}
    assert 14 * (1 - 1e-3) <= peak["T1"] <= 20 < 24 * (1 - 1e-3) <= peak["T3"] <= 32
    # A minimum-jerk fall by 60 within 3 s peaks at 1.875 * 60 / 3 at least.
    assert peak["T2"] > 37.5 > peak["T3"]


@given(seeds)
@settings(max_examples=40)
def test_t2_falls_from_90_to_30_in_less_than_3_s_once(seed):
    profile = draw_profile("T2", seed)
    levels, duration = profile.levels, profile.duration
    k = np.flatnonzero((levels[:-1] == 90) & (levels[1:] == 30))
    assert len(k) == 1
    assert 2.4 <= duration[k[0]] < 3.0
    begin = profile.start[k[0]]
    assert profile.at([begin, begin + duration[k[0]]]) == pytest.approx([90, 30])


@given(names, seeds)
@settings(max_examples=40)
def test_every_profile_begins_flat_stays_within_and_moves(name, seed):
    profile = draw_profile(name, seed)
    y = profile.at(FINE)
    assert y.min() >= 8 - 1e-9
    assert y.max() <= 92 + 1e-9
    assert np.ptp(y) >= 30
    assert profile.start[0] >= 1.0
    assert np.ptp(y[FINE < 1.0]) == 0
    # One move at a time, all of them within the trial.
    ends = profile.start + profile.duration
    assert (profile.start[1:] >= ends[:-1]).all()
    assert ends[-1] <= 25.0
    assert profile.at([-5.0, 30.0]) == pytest.approx([y[0], y[-1]])


@given(names, seeds)
@settings(max_examples=20)
def test_speed_is_the_derivative_and_moves_have_minimum_jerk(name, seed):
    profile = draw_profile(name, seed)
    h = 1e-5
    slope = (profile.at(FINE + h) - profile.at(FINE - h)) / (2 * h)
    # Central differences: h^2 / 6 times the third derivative, which is at most
    # 60 * 84 / (1 s)^3 within a move; it jumps by that at its ends, which costs h / 4
    # of it there. Rounding: 100 * 2e-16 / h.
    np.testing.assert_allclose(profile.speed(FINE), slope, atol=5040 * h / 4)
    middle = profile.start + profile.duration / 2
    np.testing.assert_allclose(profile.speed(middle), profile.peaks, rtol=1e-12)
    half = (profile.levels[1:] + profile.levels[:-1]) / 2
    np.testing.assert_allclose(profile.at(middle), half, rtol=1e-12)


def test_a_seed_gives_one_profile_and_seeds_differ():
    one, same, other = (draw_profile("T3", seed) for seed in (5, 5, 6))
    assert (one.at(FINE) == same.at(FINE)).all()
    assert not (one.at(FINE) == other.at(FINE)).all()


@pytest.mark.parametrize(("name", "seconds"), [("T4", 25.0), ("T1", 5.0)])
def test_unknown_characters_and_short_profiles_are_refused(name, seconds):
    with pytest.raises(InvalidInput):
        draw_profile(name, 0, seconds=seconds)


@given(st.integers(1, 9))
def test_a_williams_design_is_balanced_for_place_and_for_what_came_before(n):
    orders = williams(n)
    for row in orders:
        assert sorted(row) == list(range(n))
    for column in orders.T:
        assert len(set(Counter(column).values())) == 1
    pairs = Counter(pair for row in orders.tolist() for pair in pairwise(row))
    assert len(pairs) == n * (n - 1)
    assert len(set(pairs.values())) <= 1


def test_each_subject_does_nine_trials_per_condition_in_every_order_once():
    for subject in range(12):
        steps = [s for s in schedule(subject) if s.kind == "trial"]
        assert len({s.key for s in steps}) == len(steps) == 18
        blocks = [tuple(s.profile for s in steps[i : i + 3]) for i in range(0, 18, 3)]
        assert len(set(blocks)) == 6
        assert [s.repeat for s in steps] == [0, 0, 0, 1, 1, 1, 2, 2, 2] * 2


def test_orders_of_conditions_and_profiles_are_balanced_over_twelve_subjects():
    first = Counter()
    for subject in range(12):
        steps = [s for s in schedule(subject) if s.kind == "trial"]
        first[steps[0].condition, *(s.profile for s in steps[:3])] += 1
    assert len(first) == 12
    assert set(first.values()) == {1}


def test_training_comes_first_and_shows_none_of_the_profiles_of_the_study():
    steps = schedule(0, seed=7)
    kinds = [s.kind for s in steps]
    assert kinds == ["training"] * 10 + ["trial"] * 9 + ["rest"] + (
        ["training"] * 10 + ["trial"] * 9
    )
    assert {s.seed for s in steps if s.kind == "trial"} == {7}
    assert 7 not in {s.seed for s in steps if s.kind == "training"}
    # Five minutes, as in the paper.
    assert sum(s.seconds + 5 for s in steps[:10]) == 300


def test_profiles_are_the_same_for_all_subjects():
    def trials(subject):
        return {(s.profile, s.seed) for s in schedule(subject) if s.kind == "trial"}

    assert trials(0) == trials(5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"conditions": ()},
        {"profiles": ("T1", "T1")},
        {"repeats": 0},
        {"training": -1},
    ],
)
def test_impossible_designs_are_refused(wrong):
    with pytest.raises(InvalidInput):
        schedule(0, **wrong)
