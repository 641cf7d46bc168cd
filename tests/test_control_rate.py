"""Rate mode: what moves c, what leaves it alone, and what draws it back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from interpolation_layouts import make_weights_negative

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData
from ikns.live.control import RateControl, null_rate, reach_gain
from ikns.live.control.local_map import LocalMap
from ikns.live.control.null_rate import garrote
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import null_space
from ikns.simulation.arm import ArmKinematics, self_motion
from ikns.simulation.trial import true_motion

CORNERS = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0
HERE = np.array([0.1, 0.2, -0.3])
FREE = {"carry": 0.0, "travel": np.inf, "limits": None}
#: Sums of fewer than 1000 terms of order 1 round by less.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def skeleton():
    return Skeleton.load()


def straight_map(direction, *, points=CORNERS, width=0.5, **settings):
    """The same direction everywhere, c from 0 to 1 over `width`."""
    rows = np.atleast_2d(direction) / np.linalg.norm(direction, axis=-1, keepdims=True)
    everywhere = np.tile(rows, (len(points), 1, 1))
    ends = np.zeros((len(points), len(rows)))
    return NullSpaceMap.from_arrays(points, everywhere, ends, ends + width, **settings)


def varied_map(n, *, n_dof=1, seed=3, points=CORNERS, **settings):
    """Any directions and ranges around the origin."""
    rng = np.random.default_rng(seed)
    Z = np.linalg.qr(rng.normal(size=(len(points), n, n_dof)))[0]
    lower = rng.uniform(-1, 0, (len(points), n_dof))
    upper = lower + rng.uniform(0.5, 1, lower.shape)
    Z = np.swapaxes(Z, 1, 2)
    return NullSpaceMap.from_arrays(points, Z, lower, upper, **settings)


def smooth_motion(skeleton, n=200, seed=0):
    """Both arms on sines: no self-motion in particular."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) / 100
    phase = rng.uniform(0, 2 * np.pi, 18)
    angles = 0.4 + 0.3 * np.sin(np.outer(time, rng.uniform(2, 5, 18)) + phase)
    root = np.tile(skeleton.neutral()[:7], (n, 1))
    return true_motion(skeleton, time, np.hstack([root, angles]))


def replaced(motion, **changes):
    fields = {name: getattr(motion, name) for name in motion.__dataclass_fields__}
    return type(motion)(**fields | changes)


# --- the projection -------------------------------------------------------------------

matrices = arrays(float, (4, 7), elements=st.floats(-1, 1))
vectors = arrays(float, 4, elements=st.floats(-1, 1))


@given(matrices, vectors, st.booleans())
def test_task_motion_has_no_rate_in_either_metric(J, y, weighted):
    spread = np.diag(np.arange(1.0, 8.0))
    v = J.T @ y
    # W-orthogonal to the null space: v = W^-1 J' y.
    metric = np.linalg.inv(spread) if weighted else None
    v = spread @ v if weighted else v
    Z = np.eye(7)[:2]
    rate = null_rate(Z, [0.5, 1.0], null_space(J), v, metric=metric)
    # Rows that count as dependent by 1e-9 of the largest leave that much of v.
    assert np.abs(rate).max() < 1e-7 * max(1.0, np.abs(v).max())


@given(
    arrays(float, (3, 7), elements=st.floats(-1, 1)),
    arrays(float, (2, 7), elements=st.floats(-1, 1)),
    arrays(float, (3, 3), elements=st.floats(-1, 1)),
)
def test_null_motion_passes_and_the_basis_does_not_matter(rows, Z, turn):
    N = null_space(rows)[:3]
    Q = np.linalg.qr(turn + 3 * np.eye(3))[0]
    v = np.array([1.0, -2.0, 0.5]) @ N
    for basis in (N, -N, N[::-1], Q @ N):
        for metric in (None, np.diag(np.arange(1.0, 8.0))):
            rate = null_rate(Z, [0.5, 2.0], basis, v, metric=metric)
            np.testing.assert_allclose(rate, Z @ v / [0.5, 2.0], atol=ROUNDING)


def test_rows_of_zeros_stay_out():
    rng = np.random.default_rng(0)
    N = null_space(rng.normal(size=(4, 7)))
    padded, metric = np.vstack([N, np.zeros((2, 7))]), np.diag(np.arange(1.0, 8.0))
    Z, v = rng.normal(size=(1, 7)), rng.normal(size=7)
    np.testing.assert_allclose(
        null_rate(Z, [1.0], padded, v, metric=metric),
        null_rate(Z, [1.0], N, v, metric=metric),
        atol=ROUNDING,
    )


def test_many_at_once_are_each_alone():
    rng = np.random.default_rng(1)
    N = np.stack([null_space(rng.normal(size=(5, 7))) for _ in range(6)])
    Z, width = rng.normal(size=(6, 2, 7)), rng.uniform(1, 2, (6, 2))
    v = rng.normal(size=(6, 7))
    rates = null_rate(Z, width, N, v)
    for k in range(6):
        each = null_rate(Z[k], width[k], N[k], v[k])
        np.testing.assert_allclose(rates[k], each, atol=ROUNDING)


@given(
    arrays(float, 5, elements=st.floats(-1e3, 1e3)),
    st.floats(0, 1e3, allow_subnormal=False),
)
def test_what_is_let_through_keeps_its_sign_and_never_grows(values, least):
    left = garrote(values, least)
    assert (left * values >= 0).all()
    assert (np.abs(left) <= np.abs(values)).all()
    assert (left[np.abs(values) <= least] == 0).all()
    # r - t^2 / r lies within t of r.
    assert (np.abs(left - values) <= least * (1 + 1e-12)).all()


# --- what moves c ---------------------------------------------------------------------


@pytest.mark.parametrize("task", ["pose", "position"])
@pytest.mark.parametrize("weights", [None, np.arange(1.0, 8.0)])
def test_task_motion_leaves_c_alone_wherever_the_arm_is(skeleton, task, weights):
    motion = smooth_motion(skeleton)
    control = RateControl(
        varied_map(7), skeleton, task=task, metric=weights, **(FREE | {"carry": 0.0})
    )
    control.reset(0.3)
    inverse = np.ones(7) if weights is None else 1 / weights
    rng = np.random.default_rng(0)
    for q, x in zip(motion.q, motion.task_position("right_arm"), strict=True):
        J = skeleton.chain_jacobian(q, "right_arm", task=task)
        v = inverse * (J.T @ rng.normal(size=len(J)))
        c = control.step(q, v, x, 0.01, hand_speed=0.0)
    assert abs(c[0] - 0.3) < ROUNDING


def test_joints_that_the_map_does_not_use_leave_c_alone():
    rng = np.random.default_rng(0)
    Z = rng.normal(size=7)
    others = null_space(Z[None])
    control = RateControl(straight_map(Z), **FREE)
    control.reset(0.6)
    for _ in range(100):
        v = rng.normal(size=6) @ others
        c = control.step(rng.normal(size=7), v, rng.uniform(-1, 1, 3), 0.05)
    assert abs(c[0] - 0.6) < ROUNDING


def test_on_a_straight_self_motion_both_modes_are_one():
    Z = np.array([0.0, 0.6, 0.0, 0.0, 0.8, 0.0, 0.0])
    learned = straight_map(Z)
    control, q0 = RateControl(learned, **FREE), np.full(7, 0.2)
    for t in np.linspace(0, 0.5, 26):  # s = t - t^2: its rate is straight too
        q, v = q0 + (t - t**2) * Z, (1 - 2 * t) * Z
        c = control.step(q, v, HERE, 0.02)
        assert abs(c[0] - learned.control_signal(q, HERE)) < ROUNDING


def curved(skeleton):
    """A self-motion of 50 deg of swivel, and the hand's place."""
    arm = ArmKinematics(skeleton, "right")
    body = np.zeros(18)
    body[arm.columns] = np.radians([0, 0, 30, 35, -15, 80, 10, 0, 0])
    middle = arm.swivel(body)
    way = self_motion(arm, body, lowest=middle - 0.5, highest=middle + 0.4)
    return arm, body, way, arm.hand(body)[0]


def swept(control, arm, body, way, place, n, *, seconds=2.0, back=False):
    """Steps of the self-motion from end to end, smoothly, and the last posture."""
    t = np.linspace(0, 1, n + 1)
    low, high = way.swivel[[0, -1]]
    half = (high - low) / 2
    turn = 2 * np.pi if back else np.pi
    swivel = low + half * (1 - np.cos(turn * t))
    speed = half * turn * np.sin(turn * t) / seconds
    step = 1e-6
    for s, rate in zip(swivel, speed, strict=True):
        slope = (way.at(s + step) - way.at(s - step)) / (2 * step)
        q = arm.put(body, way.at(s))
        c = control.step(q, slope[2:] * rate, place, seconds / n, hand_speed=0.0)
    return c[0], way.at(s)[2:]


def test_on_a_bent_self_motion_both_modes_agree_with_the_square_of_the_step(skeleton):
    arm, body, way, place = curved(skeleton)
    learned = straight_map(np.ptp(way.postures[:, 2:], axis=0), points=place + CORNERS)
    errors = []
    for n in (25, 50, 100):
        control = RateControl(learned, skeleton, **FREE)
        c, last = swept(control, arm, body, way, place, n)
        errors.append(abs(c - learned.control_signal(last, place)))
    # Trapezoids: a quarter for half the step; the rest is of the fourth order, less
    # than a tenth of it at 25 steps.
    for coarse, fine in zip(errors[:-1], errors[1:], strict=True):
        assert 3.6 < coarse / fine < 4.4
    assert errors[-1] < 1e-3


def test_there_and_back_leaves_no_trace(skeleton):
    arm, body, way, place = curved(skeleton)
    learned = straight_map(np.ptp(way.postures[:, 2:], axis=0), points=place + CORNERS)
    control = RateControl(learned, skeleton, **FREE)
    start = learned.control_signal(way.postures[0, 2:], place)
    c, _ = swept(control, arm, body, way, place, 80, back=True)
    # The way back has the rates of the way there with the other sign, to the rounding
    # of differences over 2e-6: 1e-16 / 1e-6 rad, times 80 rates over 2 s.
    assert abs(c - start) < 1e-8


def test_a_closed_loop_in_a_plane_of_null_motions_leaves_no_trace():
    rng = np.random.default_rng(4)
    N = null_space(rng.normal(size=(3, 7)))
    Z = rng.normal(size=(2, 7))
    t = np.arange(60) * 2 * np.pi / 60
    around = np.stack([np.cos(t), -np.sin(t), 2 * np.cos(2 * t), np.sin(3 * t)], axis=1)
    total = sum(null_rate(Z, [1.0, 2.0], N, v @ N) for v in around)
    # Sines over whole periods add up to zero exactly.
    assert np.abs(total).max() < ROUNDING


def test_a_stretched_arm_has_more_null_space_and_all_of_it_counts(skeleton):
    q = np.zeros(18)
    basis, rank = skeleton.null_spaces(q, "right_arm")
    assert rank < 6
    learned, place = varied_map(7), np.zeros(3)
    control = RateControl(learned, skeleton)
    v = np.arange(1.0, len(basis) + 1) @ basis
    rate, _ = control.rate(q, v, place)
    expected = RateControl(learned).rate(np.zeros(7), v, place)[0]
    np.testing.assert_allclose(rate, expected, atol=ROUNDING)


# --- live and offline -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "n_dof", "body"),
    [("right_arm", 1, True), ("right_arm", 1, False), ("both_arms", 2, True)],
)
def test_a_motion_at_once_is_its_samples_one_by_one(skeleton, chain, n_dof, body):
    motion = smooth_motion(skeleton)
    hands = motion.hand_in_thorax.copy()
    hands[50:60] = np.nan  # out of sight
    motion = replaced(motion, hand_in_thorax=hands)
    learned = varied_map(len(chain_joints(chain)), n_dof=n_dof)
    control = RateControl(learned, skeleton if body else None, chain, carry=0.1)
    c = control.track(motion)
    control.reset()
    q = motion.q if body else motion.chain_angles(chain)
    v, x, speed = (
        motion.chain_velocities(chain),
        motion.task_position(chain),
        motion.hand_speed(chain),
    )
    steps = np.r_[0.0, np.diff(motion.time)]
    one = np.array(
        [
            control.step(q[i], v[i], x[i], steps[i], hand_speed=speed[i])
            for i in range(len(q))
        ]
    )
    np.testing.assert_array_equal(c, one[:, 0] if n_dof == 1 else one)
    assert np.isfinite(c).all()
    assert np.ptp(c) > 0


def test_joint_angles_alone_are_enough(skeleton):
    q = np.full(25, 0.3)
    v, learned = np.arange(7.0), varied_map(7)
    with_root = RateControl(learned, skeleton).rate(q, v, HERE)
    without = RateControl(learned, skeleton).rate(q[7:], v, HERE)
    np.testing.assert_array_equal(with_root, without)


def test_results_are_the_callers_own():
    control = RateControl(straight_map(np.eye(7)[0]))
    control.step(np.full(7, 0.1), np.zeros(7), HERE, 0.0)[:] = 9
    assert control.c[0] == pytest.approx(0.2)


@given(
    arrays(float, 3, elements=st.floats(-3, 3)),
    st.sampled_from([8, 3]),
    st.sampled_from(["natural", "laplace", "nearest"]),
)
def test_the_local_map_is_the_map(x, n, interpolation):
    learned = varied_map(5, n_dof=2, points=CORNERS[:n], interpolation=interpolation)
    Z, low, width = LocalMap(learned)(x)
    lower, upper = learned.range(x)
    # The same sums of 8 products in another order.
    np.testing.assert_allclose(Z, learned.directions(x), atol=1e-14)
    np.testing.assert_allclose(low, lower, atol=1e-14)
    np.testing.assert_allclose(width, upper - lower, atol=1e-14)


# --- samples that miss something ------------------------------------------------------


@pytest.mark.parametrize(
    "what", ["q", "v", "x", "hand_speed", "gap", "outside", "uncertain"]
)
def test_c_is_held_through_what_is_missing_and_does_not_jump_after(what):
    Z = np.eye(7)[2]
    learned = straight_map(Z, outside="nan")
    control = RateControl(learned, **(FREE | {"tau": np.inf}))
    sample = {"q": np.full(7, 0.2), "v": 0.3 * Z, "x": HERE}
    for _ in range(3):
        before = control.step(**sample, dt=0.01, hand_speed=0.0)
    bad, dt, speed = dict(sample), 0.01, 0.0
    if what == "gap":
        dt = 0.5
    elif what == "outside":
        bad["x"] = np.array([9.0, 0, 0])
    elif what == "hand_speed":
        speed = np.nan
    elif what == "uncertain":
        make_weights_negative(control._here._natural)
    else:
        bad[what] = bad[what].copy()
        bad[what][2] = np.nan
    assert control.step(**bad, dt=dt, hand_speed=speed) == before
    if what == "uncertain":
        make_weights_negative(control._here._natural)
    moved = {**sample, "q": np.full(7, 0.4)}  # unseen self-motion
    assert control.step(**moved, dt=0.01, hand_speed=0.0) == before
    after = control.step(**moved, dt=0.01, hand_speed=0.0)
    assert after[0] == pytest.approx(before[0] + 0.3 * 0.01 / 0.5, abs=ROUNDING)


def test_before_the_first_whole_sample_there_is_no_c():
    control = RateControl(straight_map(np.eye(7)[2]))
    assert np.isnan(control.step(np.full(7, np.nan), np.zeros(7), HERE, 0.01)).all()
    first = control.step(np.full(7, 0.2), np.ones(7), HERE, 0.01)
    assert first[0] == pytest.approx(0.4, abs=ROUNDING)


# --- drift ----------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.1])
def test_a_held_hand_draws_c_back_with_the_time_constant(dt):
    control = RateControl(straight_map(np.eye(7)[0]), tau=2.0)
    control.reset(0.9)
    sample = np.full(7, 0.2), np.zeros(7), HERE, dt
    control.step(*sample, hand_speed=0.0)
    for _ in range(round(1 / dt)):
        c = control.step(*sample, hand_speed=0.0)
    assert abs(c[0] - (0.4 + 0.5 * math.exp(-0.5))) < ROUNDING
    for _ in range(5):
        assert control.step(*sample, hand_speed=0.06) == c


def test_an_offset_goes_while_the_person_moves_c_and_only_then():
    Z = np.eye(7)[0]
    learned = straight_map(Z)
    control = RateControl(learned, carry=0.0, travel=0.1)
    control.reset(0.15)
    q = 0.05 * Z  # position mode says 0.1
    for _ in range(50):
        c = control.step(q, 0 * Z, HERE, 0.01, hand_speed=0.0)
    assert c == 0.15
    for k in range(1, 21):  # and back, so that limits are far
        way = 0.1 * Z * (1 if k % 2 else -1)
        control.step(q, way, HERE, 0.0, hand_speed=0.0)
        q = q + 0.01 * way
        c = control.step(q, way, HERE, 0.01, hand_speed=0.0)
    # Each step moves c by 0.002; steps of zero length only turn the velocity.
    expected = 0.05 * math.exp(-20 * 0.002 / 0.1)
    assert abs(c[0] - learned.control_signal(q, HERE) - expected) < ROUNDING


def test_however_far_off_c_never_runs_against_the_person():
    Z = np.eye(7)[0]
    control = RateControl(straight_map(Z), carry=0.0, travel=1e-3)
    control.reset(0.9)
    c = [control.step(0.01 * k * Z, Z, HERE, 0.01, hand_speed=0.0)[0] for k in range(9)]
    # Position mode is far below, so c waits for it: 0.02 a step, taken off again.
    np.testing.assert_allclose(c, 0.9, atol=ROUNDING)
    control.reset(0.0)
    c = [
        control.step((0.4 + 0.01 * k) * Z, Z, HERE, 0.01, hand_speed=0.0)[0]
        for k in range(9)
    ]
    np.testing.assert_allclose(np.diff(c), 0.04, atol=ROUNDING)  # twice as fast


def test_beyond_a_stop_nothing_is_wound_up():
    Z = np.eye(7)[0]
    control = RateControl(straight_map(Z), carry=0.0, travel=np.inf)
    control.reset(0.95)
    for way in (Z, -Z):
        for _ in range(31):
            high = control.step(0 * Z, way, HERE, 0.01, hand_speed=0.0)
        if way is Z:
            assert high == 1.0
    # One trapezoid from +1 to -1 adds nothing; 30 go back by 0.02 each.
    assert high[0] == pytest.approx(0.4, abs=ROUNDING)


def test_what_a_reach_carries_along_does_not_count():
    Z = np.eye(7)[0]
    control = RateControl(straight_map(Z), carry=2.0, travel=np.inf)
    control.reset(0.5)
    for _ in range(20):  # 1.2 per s at 0.6 m/s: as much as is carried
        c = control.step(0 * Z, 0.6 * Z, HERE, 0.01, hand_speed=0.6)
    assert c == 0.5
    control.reset(0.5)
    for _ in range(11):  # 2.4 per s: less by 1.2^2 / 2.4
        c = control.step(0 * Z, 1.2 * Z, HERE, 0.01, hand_speed=0.6)
    assert abs(c[0] - (0.5 + 0.1 * (2.4 - 0.6))) < ROUNDING


def test_without_a_speed_the_place_tells_it():
    Z = np.eye(7)[0]
    told, seen = (RateControl(straight_map(Z), travel=np.inf) for _ in range(2))
    for k in range(10):
        x, speed = HERE + [0.005 * k, 0, 0], 0.5 if k else 0.0
        one = told.step(0 * Z, 0.5 * Z, x, 0.01, hand_speed=speed)
        two = seen.step(0 * Z, 0.5 * Z, x, 0.01)
    # Differences of places of order 1 over 0.01 s: 1e-14 of the speed.
    np.testing.assert_allclose(one, two, atol=ROUNDING)


def test_what_is_carried_is_found_as_a_share_of_the_way(skeleton):
    motion = smooth_motion(skeleton, 120)
    speed, joints = motion.hand_speed("right_arm"), chain_joints("right_arm")
    ratio = np.linspace(0.1, 0.9, 120)
    column = motion.joint_names.index(joints[0]) + 6
    v = motion.v.copy()
    v[:, 6:] = 0
    v[:, column] = 0.5 * ratio * speed  # a width of 0.5 makes it the ratio
    control = RateControl(straight_map(np.eye(7)[0]))
    moved = replaced(motion, v=v)
    assert (speed > 0.05).all()
    for quantile in (0.0, 0.5, 1.0):
        found = reach_gain(control, moved, quantile=quantile)[0]
        share = speed[ratio <= found + 1e-9].sum() / speed.sum()
        # One sample more or less, of 120.
        assert abs(share - quantile) <= 2 * speed.max() / speed.sum()
    control = RateControl(control.null_space_map, carry=0.9 + 1e-9, travel=np.inf)
    assert np.ptp(control.track(moved)) == 0
    # While the hand is as good as held, c may go as fast as it will.
    held = np.arange(120) < 40
    v[held, column] *= 10
    hand = moved.hand_velocity_in_thorax.copy()
    hand[held] *= 0.04 / speed[held, None, None]
    slow = replaced(motion, v=v, hand_velocity_in_thorax=hand)
    for quantile, expected in ((0.0, ratio[40]), (1.0, 0.9)):
        found = reach_gain(control, slow, quantile=quantile)
        assert found == pytest.approx(expected, rel=ROUNDING)


# --- what does not fit ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"chain": "both_arms"}, "a map of 14 joints for both_arms, not 7"),
        ({"chain": "third_arm"}, "unknown chain"),
        ({"task": "grasp"}, "task 'pose' or 'position', not 'grasp'"),
        ({"carry": -1.0}, "carry of at least 0"),
        ({"carry": [1.0, 2.0]}, "carry of at least 0"),
        ({"carry": np.nan}, "carry of at least 0"),
        ({"travel": 0.0}, "travel above 0"),
        ({"tau": -1.0}, "tau above 0 s"),
        ({"max_hand_speed": 0.0}, "max_hand_speed above 0"),
        ({"limits": (1.0, 0.0)}, "limits low < high"),
        ({"metric": np.zeros(7)}, "symmetric positive metric"),
        ({"metric": np.ones((3, 3))}, "symmetric positive metric"),
    ],
)
def test_settings_that_mean_nothing_are_refused(settings, sentence):
    with pytest.raises(InvalidInput, match=sentence):
        RateControl(straight_map(np.eye(7)[0]), **settings)


def test_samples_of_another_body_are_refused(skeleton):
    learned = straight_map(np.eye(7)[0])
    with pytest.raises(InvalidInput, match=r"expected q \(25,\) and v \(7,\)"):
        RateControl(learned, skeleton).step(np.zeros(7), np.zeros(7), HERE, 0.01)
    with pytest.raises(InvalidInput, match=r"expected q \(7,\) and v \(7,\)"):
        RateControl(learned).step(np.zeros(7), np.zeros(9), HERE, 0.01)
    with pytest.raises(InvalidInput, match="finite c for 1"):
        RateControl(learned).reset([0.1, 0.2])


def test_a_hand_that_never_travels_carries_nothing(skeleton):
    motion = smooth_motion(skeleton, 30)
    still = replaced(motion, hand_velocity_in_thorax=np.zeros((30, 2, 3)))
    control = RateControl(straight_map(np.eye(7)[0]))
    with pytest.raises(NotEnoughData, match="none of 30"):
        reach_gain(control, still)
    with pytest.raises(InvalidInput, match="quantile"):
        reach_gain(control, motion, quantile=2.0)
