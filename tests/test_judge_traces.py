"""The judge of single traces, and of names that are exchanged for a while."""

from itertools import combinations

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ikns.calibration.judge.distances import (
    all_distances,
    exchanged_by_distance,
    pair_distances,
)
from ikns.calibration.judge.finding import say_frames
from ikns.calibration.judge.jumps import find_jumps
from ikns.calibration.judge.quality import judge_quality, marker_noise
from ikns.calibration.judge.steps import find_steps
from ikns.calibration.judge.traces import frozen, stand_ins, straight
from ikns.calibration.judge.unit import wrong_unit

RATE, FRAMES, MARKERS = 100.0, 120, 6
TIME = np.arange(FRAMES) / RATE


def swinging(seed: int) -> np.ndarray:
    """Six markers at least 60 mm apart, each swinging by up to 0.3 m at up to 1 Hz.

    Noise of 1 mm turns the line between two by less than a tenth, and a step of 33 mm
    is less than the 60 mm by which a ghost leaves its path.
    """
    rng = np.random.default_rng(seed)
    places = np.arange(MARKERS)[:, None] * [0.06, 0.02, 0.0]
    phase = rng.uniform(0, 2 * np.pi, 3)
    swing = rng.uniform(0.05, 0.3) * np.sin(2 * np.pi * TIME[:, None] + phase)
    noise = rng.normal(0, 1e-3, (FRAMES, MARKERS, 3))
    return places + swing[:, None] + noise


@given(seed=st.integers(0, 10**6))
@settings(max_examples=20)
def test_ordinary_movement_is_no_jump(seed):
    found = find_jumps(TIME, swinging(seed))
    assert not found.exchanged
    assert not found.astray


@given(
    seed=st.integers(0, 10**6),
    pair=st.lists(st.integers(0, MARKERS - 1), min_size=2, max_size=2, unique=True),
    first=st.integers(1, 80),
    count=st.integers(1, 35),
)
@settings(max_examples=40)
def test_two_names_exchanged_for_a_while_are_told_with_their_frames(
    seed, pair, first, count
):
    markers = swinging(seed)
    rows = slice(first, first + count)
    markers[rows, pair] = markers[rows, pair[::-1]]
    found = find_jumps(TIME, markers)
    assert list(found.exchanged) == [tuple(sorted(pair))]
    (frames,) = found.exchanged.values()
    assert np.flatnonzero(frames).tolist() == list(range(first, first + count))
    assert not found.astray


@given(
    seed=st.integers(0, 10**6),
    marker=st.integers(0, MARKERS - 1),
    first=st.integers(1, 80),
    count=st.integers(1, 35),
    # Beyond the markers' row, which is 0.3 m long and swings by as much.
    away=st.floats(0.7, 5.0),
)
@settings(max_examples=40)
def test_a_ghost_is_told_with_its_frames(seed, marker, first, count, away):
    markers = swinging(seed)
    markers[first : first + count, marker] += [0.0, 0.0, away]
    found = find_jumps(TIME, markers)
    assert list(found.astray) == [marker]
    inside = np.flatnonzero(found.astray[marker]).tolist()
    assert inside == list(range(first, first + count))
    assert not found.exchanged


@given(
    seed=st.integers(0, 10**6),
    number=st.sampled_from([-16.512, 9999.999, 0.0, -1.0, 1e-3]),
    marker=st.integers(0, MARKERS - 1),
    rows=st.sets(st.integers(0, FRAMES - 1), min_size=1, max_size=60),
)
@settings(max_examples=40)
def test_numbers_that_stand_for_not_seen_are_found_and_nothing_else(
    seed, number, marker, rows
):
    markers = swinging(seed)
    assert not stand_ins(markers).any()
    markers[sorted(rows), marker] = number
    found = np.argwhere(stand_ins(markers))
    assert found.tolist() == [[row, marker] for row in sorted(rows)]


def test_two_markers_at_one_place_are_a_number_for_not_seen():
    markers = swinging(1)
    markers[40:50, [2, 4]] = [0.3, 1.2, 0.4]
    found = stand_ins(markers)
    assert np.flatnonzero(found.any(axis=1)).tolist() == list(range(40, 50))
    assert np.flatnonzero(found.any(axis=0)).tolist() == [2, 4]


def test_a_frozen_marker_is_told_unless_everything_rests():
    markers = swinging(2)
    markers[30:80, 3] = markers[30, 3]
    found = frozen(TIME, markers)
    assert np.flatnonzero(found.any(axis=0)).tolist() == [3]
    assert say_frames(found[:, 3]) == "31-80"
    resting = np.tile(markers[:1], (FRAMES, 1, 1))
    assert not frozen(TIME, resting).any()


def test_no_frames_and_no_markers_have_no_faults():
    for shape in ((0, 3, 3), (1, 3, 3), (5, 0, 3)):
        markers = np.full(shape, np.nan)
        time = np.arange(shape[0]) / RATE
        assert not any(find_jumps(time, markers))
        assert not stand_ins(markers).any()
        assert not frozen(time, markers).any()


@given(seed=st.integers(0, 10**6), a=st.integers(0, 2), b=st.integers(3, 5))
@settings(max_examples=20)
def test_two_rigid_bodies_with_names_exchanged_between_them_are_mended(seed, a, b):
    rng = np.random.default_rng(seed)
    bodies = rng.normal(0, 0.1, (MARKERS, 3))
    # The second body goes 0.5 m away and back; all distances between the two change.
    way = 0.5 * np.sin(np.pi * TIME / TIME[-1])
    markers = np.tile(bodies, (FRAMES, 1, 1))
    markers[:, 3:, 0] += 1.0 + way[:, None]
    markers += rng.normal(0, 1e-3, markers.shape)
    pairs = np.array([[0, 1], [0, 2], [1, 2], [3, 4], [3, 5], [4, 5]])
    assert exchanged_by_distance(all_distances(markers), pairs, None)[0] == []
    markers[:, [a, b]] = markers[:, [b, a]]
    exchanges, left = exchanged_by_distance(all_distances(markers), pairs, None)
    assert exchanges == [(a, b)]
    assert not left.any()


@given(
    person=st.floats(0.75, 1.3),
    factor=st.sampled_from([0.001, 0.01, 1 / 25.4, 0.1, 10.0, 25.4, 100.0, 1000.0]),
)
def test_every_mistake_of_units_is_named_whatever_the_persons_size(person, factor):
    assert wrong_unit(person) is None
    found = wrong_unit(person * factor)
    assert found is not None
    assert np.isclose(found[0], factor)
    assert found[1]


@given(seed=st.integers(0, 10**6), first=st.integers(2, 110))
@settings(max_examples=20)
def test_a_jump_of_all_markers_is_none_of_a_single_one(seed, first):
    # Recordings joined: the room, or the posture, is another from one frame on.
    rng = np.random.default_rng(seed)
    markers = swinging(seed)
    markers[first:] += 0.5 + rng.uniform(0, 0.2, (MARKERS, 3))
    found = find_jumps(TIME, markers)
    assert found.together == [first]
    assert not found.astray
    # A pause of the cameras is no jump: time says so.
    assert find_jumps(np.where(TIME < first / RATE, TIME, TIME + 1), markers) == (
        {},
        {},
        [],
    )


@given(seed=st.integers(0, 10**6), first=st.integers(1, 80), count=st.integers(1, 35))
@settings(max_examples=20)
def test_three_names_that_went_round_are_told_together(seed, first, count):
    rng = np.random.default_rng(seed)
    own = rng.permutation(MARKERS)[:3]
    # A slow one, as three have no line between them that turns round.
    markers = np.tile(swinging(seed)[:1], (FRAMES, 1, 1))
    markers += rng.normal(0, 1e-3, markers.shape)
    rows = slice(first, first + count)
    markers[rows, own] = markers[rows, np.roll(own, 1)]
    found = find_jumps(TIME, markers)
    assert list(found.exchanged) == [tuple(sorted(own.tolist()))]
    (frames,) = found.exchanged.values()
    assert np.flatnonzero(frames).tolist() == list(range(first, first + count))


def hidden(markers: np.ndarray, seed: int) -> np.ndarray:
    """Hide 5 % of the positions."""
    lost = np.random.default_rng(seed).random(markers.shape[:2]) < 0.05
    return np.where(lost[..., None], np.nan, markers)


@given(
    seed=st.integers(0, 10**6),
    marker=st.integers(0, MARKERS - 1),
    first=st.integers(0, 60),
    count=st.integers(30, 60),
    digits=st.sampled_from([5, 6, 9]),
)
@settings(max_examples=30)
def test_filled_gaps_are_told_and_movement_is_not(seed, marker, first, count, digits):
    markers = hidden(swinging(seed), seed)
    assert not straight(TIME, markers).any()
    assert not frozen(TIME, markers).any()
    rows = slice(first, first + count)
    # 0.3 mm a frame, written with three digits after the millimeter or more.
    line = np.arange(count)[:, None] * [2e-4, -2e-4, 1e-3]
    markers[rows, marker] = np.round(line, digits)
    found = straight(TIME, markers)
    assert np.flatnonzero(found.any(axis=0)).tolist() == [marker]
    assert np.flatnonzero(found[:, marker]).tolist() == list(range(first, rows.stop))
    markers[rows, marker] = [0.1, 0.2, 0.3]
    found = frozen(TIME, markers)
    assert np.flatnonzero(found[:, marker]).tolist() == list(range(first, rows.stop))


@given(speed=st.floats(0.2, 3.0), rate=st.sampled_from([50.0, 100.0, 1000.0]))
@settings(max_examples=20)
def test_smooth_movement_is_no_filled_gap(speed, rate):
    # Without any noise, half a second of a swing, through the middle of which a marker
    # runs evenly: its acceleration t s from there is v^3 t / (0.2 m)^2. For 0.25 s all
    # second differences, at 50 Hz of 0.02 s, stay below 5 um up to v = 0.17 m/s.
    time = np.arange(round(0.5 * rate)) / rate
    place = 0.2 * np.sin(speed / 0.2 * (time - 0.25))
    markers = place[:, None, None] * np.ones((1, 4, 3))
    markers[:, 1:] += np.arange(1, 4)[:, None] + 0.1 * time[:, None, None] ** 2
    assert not straight(time, markers).any()


@given(
    seed=st.integers(0, 10**6),
    marker=st.integers(0, MARKERS - 1),
    first=st.integers(10, FRAMES - 10),
    by=st.floats(0.02, 0.05),
)
@example(seed=5, marker=0, first=10, by=0.03125)  # with noise that jumps 2 frames later
# Of 3000 draws of noise 2 look like a step; these are always the same.
@settings(max_examples=30, derandomize=True)
def test_a_marker_that_is_knocked_is_told_and_skin_that_gives_way_is_not(
    seed, marker, first, by
):
    # Distances change by 16 mm and back once a second, as the worst of seven people's.
    markers = swinging(seed)
    skin = 0.004 * np.sin(2 * np.pi * TIME)
    markers += skin[:, None, None] * np.array([1.0, -1, 1, -1, 1, -1])[:, None]
    pairs = np.array(list(combinations(range(MARKERS), 2)))
    assert find_steps(pair_distances(markers, pairs), pairs) == []
    # Across the line on which they sit, and along it, so that distances change.
    row = np.array([0.06, 0.02, 0.0]) / np.hypot(0.06, 0.02)
    markers[first:, marker] += by * row
    found = find_steps(pair_distances(markers, pairs), pairs)
    assert [(t, m) for t, m, _ in found] == [(first, marker)]
    # The difference of two medians of ten frames: noise of 0.8 mm, in the largest of
    # five up to five times that; and what the skin does in 0.1 s, 5 mm.
    assert abs(found[0][2] - by) < 0.009


def kinds(markers: np.ndarray) -> list[str]:
    labels = [f"M{i}" for i in range(markers.shape[1])]
    time = np.arange(len(markers)) / RATE
    return [found.kind for found in judge_quality("a.c3d", labels, time, markers)]


@given(seed=st.integers(0, 10**6), noise=st.floats(1e-4, 0.02))
@settings(max_examples=20)
def test_noise_is_measured_beside_movement(seed, noise):
    rng = np.random.default_rng(seed)
    clean = swinging(seed).mean(axis=1, keepdims=True)  # 0.4 mm are left of its noise
    markers = clean + rng.normal(0, noise, (FRAMES, 1, 3))
    # 0.3 m at 1 Hz bends by 1.2 mm between frames at most, 0.33 mm of noise; a median
    # of 354 absolute values scatters by 1.2 / sqrt(354), overlapping ones by 1.5 times.
    (found,) = marker_noise(markers)
    assert abs(found - np.hypot(noise, 4e-4)) < 4 * 0.1 * found + 4e-4


def test_noise_digits_and_gaps_are_told():
    clean = swinging(1)
    assert kinds(clean) == []
    assert kinds(clean.round(3)) == []  # whole millimeters
    assert kinds(clean.round(2)) == ["coarse"]
    rng = np.random.default_rng(2)
    assert kinds(clean + rng.normal(0, 0.01, clean.shape)) == ["noise"]
    clean[rng.random(clean.shape[:2]) < 0.5] = np.nan
    assert kinds(clean) == ["gaps"]
    assert kinds(np.full((20, 3, 3), np.nan)) == []
