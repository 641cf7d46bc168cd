import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.numerics.turns import nearest_turn, without_turns

TURN = 2 * np.pi
#: Steps of a joint from row to row, rad: below half a turn, where the way is ambiguous.
steps = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=60)
seeds = st.integers(0, 2**32 - 1)
#: Sums of at most 60 numbers below 400, each rounded at 1e-16 of them.
ROUNDING = 1e-10


def same_posture(a, b):
    return np.abs((a - b) / TURN - np.round((a - b) / TURN)).max() < ROUNDING


@given(steps, seeds)
def test_angles_stay_the_same_on_the_circle(moves, seed):
    rng = np.random.default_rng(seed)
    q = np.cumsum(moves)
    held = rng.random(len(q)) < 0.5
    found = without_turns(q, held)
    assert same_posture(found, q)
    # Within a visit the joint moves as it did.
    both = held[1:] & held[:-1]
    np.testing.assert_allclose(np.diff(found)[both], np.diff(q)[both], atol=ROUNDING)


@given(steps, seeds)
def test_however_a_controller_wraps_angles_they_come_back_the_same(moves, seed):
    rng = np.random.default_rng(seed)
    q = np.cumsum(moves)
    held = rng.random(len(q)) < 0.5
    plain = without_turns(q, held)
    wrapped = without_turns(q + TURN * rng.integers(-2, 3, len(q)), held)
    assert same_posture(wrapped, plain)
    # As one path: which full turn it lies in is the first row's.
    if held.any():
        assert np.ptp((wrapped - plain)[held]) < ROUNDING


@given(st.integers(2, 8), st.floats(-np.pi, np.pi), seeds)
@settings(max_examples=50)
def test_visits_to_one_posture_agree_however_often_the_joint_turned(n, about, seed):
    rng = np.random.default_rng(seed)
    visits = [about + rng.uniform(-0.5, 0.5, 5) for _ in range(n)]
    ways = TURN * rng.integers(-3, 4, n)
    rows = []
    for visit, turns in zip(visits, ways, strict=True):
        start = rows[-1] if rows else visit[0]
        # On the way 2 rad a row at most, so that the turns can be followed.
        way = np.linspace(start, visit[0] + turns, 40)
        rows += [*way, *(visit + turns)]
    held = np.tile(np.repeat([False, True], [40, 5]), n)
    found = without_turns(np.array(rows) % TURN, held)[held]
    # All visits are drawn from one rad.
    assert np.ptp(found) <= 1 + ROUNDING


def test_rows_that_are_missing_stay_missing():
    q = np.array([3.0, np.nan, -3.0, np.nan])
    found = without_turns(q, np.array([True, False, True, False]))
    np.testing.assert_allclose(found, [3.0, np.nan, TURN - 3.0, np.nan])


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_the_nearest_turn_is_within_half_a_turn(angle, center):
    found = nearest_turn(angle, center)
    assert same_posture(found, np.array(angle))
    assert abs(found - center) <= np.pi + ROUNDING
