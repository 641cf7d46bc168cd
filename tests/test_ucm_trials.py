"""Trials are cut to their movement and laid over each other in normalized time."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st

from ikns.analysis.ucm import aligned_angles, movement, normalize_time
from ikns.analysis.ucm.trials import check_repeats
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.recording.files import read

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


def reaching(end: tuple, side: int = 0, *, late: float = 0.0, seed: int = 0) -> Motion:
    """A hand that goes to a place and rests, with 1 cm of wandering."""
    base = small_person.protocol().points.truth
    time = np.arange(150) / 100
    share = np.clip((time - 0.2 - late) / 0.8, 0, 1)
    share = 10 * share**3 - 15 * share**4 + 6 * share**5
    rng = np.random.default_rng(seed)
    bend = 0.01 * rng.normal(size=3) * np.sin(np.pi * share)[:, None]
    hands = np.zeros((150, 2, 3))
    hands[:, side] = share[:, None] * np.array(end) + bend
    return replace(
        base,
        time=time,
        q=base.q[:150],
        v=base.v[:150],
        hand_in_thorax=hands,
        hand_rotation_in_thorax=base.hand_rotation_in_thorax[:150],
        hand_velocity_in_thorax=np.gradient(hands, 0.01, axis=0),
        residual=base.residual[:150],
        iterations=base.iterations[:150],
        converged=base.converged[:150],
        seen=np.ones((1, len(base.segments)), dtype=bool),
        known=np.ones((1, 1), dtype=bool),
        rejected=np.full((1, 2), -1),
    )


def test_repetitions_of_one_movement_pass_wherever_they_start() -> None:
    trials = [reaching((0.3, 0.1, 0.0), late=0.02 * k, seed=k) for k in range(5)]
    aside = replace(trials[0], hand_in_thorax=trials[0].hand_in_thorax + 0.1)
    check_repeats([*trials, aside], [f"{k}.c3d" for k in range(6)], "right_arm")


def test_another_movement_among_repetitions_is_named_with_one_of_them() -> None:
    trials = [reaching((0.3, 0.1, 0.0), seed=k) for k in range(3)]
    trials.append(reaching((0.0, 0.1, -0.3)))
    names = ["a.c3d", "b.c3d", "c.c3d", "other.c3d"]
    # Straight ways at 84 deg: 2 sin(42 deg) = 1.3 times the deviation of one from its
    # middle, which is 0.3 to 0.5 of its length.
    with pytest.raises(InvalidInput, match=r"[abc].c3d and other.c3d that differ by"):
        check_repeats(trials, names, "right_arm")
    check_repeats(trials, names, "right_arm", most_different=1.0)


def test_trials_of_the_other_arm_are_refused() -> None:
    trials = [reaching((0.3, 0.1, 0.0)), reaching((0.3, 0.1, 0.0), side=1)]
    with pytest.raises(InvalidInput, match=r"l.c3d: .* right hand moves 0 cm and the"):
        check_repeats(trials, ["r.c3d", "l.c3d"], "right_arm")
    with pytest.raises(InvalidInput, match=r"r.c3d: .* left hand moves 0 cm and the"):
        check_repeats(trials, ["r.c3d", "l.c3d"], "left_arm")


def test_real_tasks_are_told_apart_and_their_repeats_are_not(data: Path) -> None:
    folder = data / "ue_adl" / "ADL007"
    skeleton, _ = scale(
        Skeleton.load(),
        read(folder / "ADL007_static.csv"),
        marker_set="ue_adl",
        min_duration=0.15,
    )
    solver = MarkerIK(skeleton)
    names = ["FR1", "FR2", "FR3", "AR1", "FL1"]
    motions = [solver.track(read(folder / f"ADL007{name}.csv")) for name in names]
    check_repeats(motions[:3], names[:3], "right_arm")
    with pytest.raises(InvalidInput, match="and AR1 that differ"):
        check_repeats(motions[:4], names[:4], "right_arm")
    with pytest.raises(InvalidInput, match="FL1: expected a movement of right_arm"):
        check_repeats([motions[0], motions[4]], ["FR1", "FL1"], "right_arm")
