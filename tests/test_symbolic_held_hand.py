"""What a held hand leaves: against the closed form, another walk, and brute force."""

from dataclasses import replace

import numpy as np
import pytest
from example_robot_data import robots_loader
from scipy.optimize import brentq, minimize
from scipy.spatial.transform import Rotation

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Robot, Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.simulation.arm import ArmKinematics, self_motion
from ikns.symbolic import (
    HeldHand,
    available_control,
    available_range,
    capsules,
)
from ikns.symbolic.volumes import Capsule, arm_pairs

#: The optimizer keeps the hand to 1e-9 m and rad; with a joint at its limit the others
#: follow within 1e-9 over the sine of how steeply the curve meets the limit.
END = 1e-6


@pytest.fixture(scope="module")
def skeleton():
    return Skeleton.load()


@pytest.fixture(scope="module")
def limits_alone(skeleton):
    return HeldHand(skeleton, "right_arm", pairs=())


def columns(skeleton, chain="right_arm"):
    return skeleton.columns(chain_joints(chain)) - 6


def angles(skeleton, degrees, chain="right_arm"):
    q = np.zeros(18)
    q[columns(skeleton, chain)] = np.radians(degrees)
    return q


POSTURES = (
    [30, 40, 0, 90, 0, 0, 0],
    [20, 60, -20, 70, 30, 10, 5],
    [60, 30, 10, 100, -20, -10, 10],
    [10, 20, 30, 60, 0, 20, -10],
)


def swiveled(q, psi):
    """Closed form: the arm's angles (..., 7) after the elbow turned by psi (...).

    Shoulder and wrist are spherical, so the bones turn about the line between the two
    as one piece: the elbow's angle stays, and each joint's three angles are a
    factoring of a rotation.
    """
    shoulder = Rotation.from_euler("XZY", q[:3] * [-1, 1, 1])
    carried = Rotation.from_euler("Z", q[3]) * Rotation.from_euler("X", -0.226893)
    wrist = Rotation.from_euler("YXZ", q[4:] * [1, 1, -1])
    hand = shoulder * carried * wrist
    upper, lower = np.array([0, -0.2712, 0]), np.array([0, -0.2597, 0])
    line = shoulder.apply(upper) + (shoulder * carried).apply(lower)
    psi = np.asarray(psi)[..., None]
    turn = Rotation.from_rotvec(psi * line / np.linalg.norm(line))
    at_shoulder = turn * shoulder
    at_wrist = (at_shoulder * carried).inv() * hand
    return np.concatenate(
        [
            at_shoulder.as_euler("XZY") * [-1, 1, 1],
            np.broadcast_to(q[3], psi.shape),
            at_wrist.as_euler("YXZ") * [1, 1, -1],
        ],
        axis=-1,
    )


def closed_form_turn(skeleton, q, way):
    """Turn of the elbow at which it first meets a joint limit, rad."""
    own = columns(skeleton)
    lower, upper = skeleton.lower[own], skeleton.upper[own]

    def room(psi):
        x = swiveled(q, way * psi)
        return np.minimum(x - lower, upper - x).min(axis=-1)

    steps = np.arange(0, np.pi, 0.01)
    first = int(np.argmax(room(steps) < 0))
    return way * brentq(room, steps[first - 1], steps[first], xtol=1e-13)


@pytest.mark.parametrize("degrees", POSTURES)
def test_a_sweep_ends_where_the_swivel_circle_meets_a_limit(
    skeleton, limits_alone, degrees
):
    q = angles(skeleton, degrees)
    x = q[columns(skeleton)]
    ahead = swiveled(x, 1e-4) - x
    found = limits_alone.sweep(q, direction=ahead)
    assert found.solved == (True, True)
    for posture, stops, way in zip(
        found.postures[[0, -1]], found.stops, (-1, 1), strict=True
    ):
        end = swiveled(x, closed_form_turn(skeleton, x, way))
        np.testing.assert_allclose(posture, end, rtol=0, atol=END)
        for stop in stops:
            joint, side = stop.split(" at its ")
            bound = skeleton.lower if side.startswith("lower") else skeleton.upper
            at = list(chain_joints("right_arm")).index(joint)
            assert posture[at] == pytest.approx(bound[columns(skeleton)][at], abs=END)
        assert stops


@pytest.mark.parametrize("degrees", POSTURES)
def test_every_posture_of_a_sweep_holds_the_hand_on_the_swivel_circle(
    skeleton, limits_alone, degrees
):
    q = angles(skeleton, degrees)
    found = limits_alone.sweep(q)
    every = np.tile(q, (len(found.postures), 1))
    every[:, columns(skeleton)] = found.postures
    position, rotation = skeleton.link_in_thorax(every, "right_knuckle")
    held_p, held_R = skeleton.link_in_thorax(q, "right_knuckle")
    # 1e-9 is the optimizer's tolerance; a unit of rounding comes on top.
    np.testing.assert_allclose(position - held_p, 0, atol=2e-9)
    np.testing.assert_allclose(rotation - held_R, 0, atol=2e-9)
    shoulder = skeleton.link_in_thorax(every, "right_upper_arm")[0]
    elbow = skeleton.link_in_thorax(every, "right_forearm")[0]
    wrist = skeleton.link_in_thorax(every, "right_hand")[0]
    line = (wrist - shoulder)[0] / np.linalg.norm((wrist - shoulder)[0])
    radius = np.linalg.norm(np.cross(elbow - shoulder, line), axis=1)
    np.testing.assert_allclose(radius, radius[0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.postures[:, 3], q[columns(skeleton)][3], atol=1e-7)
    swivel = skeleton.swivel(every)[:, 0]
    assert (np.diff(swivel) > 0).all() or (np.diff(swivel) < 0).all()
    steps = np.linalg.norm(np.diff(found.postures, axis=0), axis=1)
    for side in (steps[:8], steps[8:]):
        np.testing.assert_allclose(side, side[0], rtol=0, atol=1e-7)


def test_a_walk_that_stays_off_the_limits_lies_within_the_sweep(skeleton, limits_alone):
    q = angles(skeleton, POSTURES[0])
    found = limits_alone.sweep(q)
    walked = self_motion(ArmKinematics(skeleton, "right"), q, lowest=-3.0, highest=3.0)
    every = np.tile(q, (2, 1))
    every[:, columns(skeleton)] = found.postures[[0, -1]]
    ends = np.sort(skeleton.swivel(every)[:, 0])
    # The walk keeps 5 deg off each limit, and its stride is 0.04 rad of joint space.
    assert ends[0] < walked.swivel[0] < ends[0] + np.radians(15)
    assert ends[1] - np.radians(15) < walked.swivel[-1] < ends[1]


@pytest.mark.parametrize("degrees", POSTURES)
def test_the_range_of_a_direction_is_the_widest_of_the_closed_form(
    skeleton, limits_alone, degrees
):
    q = angles(skeleton, degrees)
    x = q[columns(skeleton)]
    Z = skeleton.null_spaces(q, "right_arm")[0][0]
    found = limits_alone.range(q, Z)
    turns = [closed_form_turn(skeleton, x, way) for way in (-1, 1)]
    along = swiveled(x, np.linspace(*turns, 4001)) @ Z
    # Between two of them, 1e-3 rad apart, Z x bends by less than 1e-3^2.
    assert found.freedom == 1
    assert found.solved == (True, True)
    assert found.lower == pytest.approx(along.min(), abs=2e-6)
    assert found.upper == pytest.approx(along.max(), abs=2e-6)


def test_a_direction_across_the_curve_turns_back(skeleton, limits_alone):
    q = angles(skeleton, POSTURES[0])
    x = q[columns(skeleton)]
    # The middle of three postures lies farther along the bend than either end.
    bend = 2 * x - swiveled(x, 0.5) - swiveled(x, -0.5)
    found = limits_alone.range(q, bend)
    assert found.stops[1] == ("turns back",)
    J = skeleton.chain_jacobian(q_at(skeleton, q, found.postures[1]), "right_arm")
    # Stationary: the direction has no part along the null space there.
    null = np.linalg.svd(J)[2][-1]
    assert abs(null @ bend) / np.linalg.norm(bend) < 1e-6


def q_at(skeleton, q, posture, chain="right_arm"):
    changed = q.copy()
    changed[columns(skeleton, chain)] = posture
    return changed


def gap(skeleton, q, one, other):
    """Room between two capsules by minimizing over both segments, m."""
    points = []
    for capsule in (one, other):
        p, R = skeleton.link_in_thorax(q, capsule.link)
        points.append([p + R @ np.array(end) for end in (capsule.start, capsule.end)])

    def apart(s):
        a, b = (e[0] + t * (e[1] - e[0]) for e, t in zip(points, s, strict=True))
        return float(np.sum((a - b) ** 2))

    starts = [(s, t) for s in (0.1, 0.9) for t in (0.1, 0.9)]
    best = min(
        minimize(
            apart, s, bounds=[(0, 1)] * 2, options={"ftol": 1e-16, "gtol": 1e-12}
        ).fun
        for s in starts
    )
    return np.sqrt(best) - one.radius - other.radius


def test_the_room_between_volumes_is_that_of_brute_force(skeleton):
    hand = HeldHand(skeleton, "right_arm", task="position")
    rng = np.random.default_rng(0)
    assert len(hand.held.names) == 27  # 2 limbs, 7 rods; trunk, neck and head
    for _ in range(4):
        q = rng.uniform(skeleton.lower, skeleton.upper)
        rooms = hand.held.clearance(q[columns(skeleton)], q).full().ravel()
        for (one, _, other, _), room in zip(hand.chain.pairs, rooms, strict=True):
            # L-BFGS ends on 1e-12 of a squared distance of 0.1 m^2 or so.
            assert room == pytest.approx(gap(skeleton, q, one, other), abs=1e-5)


def test_a_volume_ends_a_sweep_that_a_limit_would_not(skeleton):
    # A ball in the way of the elbow.
    q = angles(skeleton, POSTURES[0])
    free = HeldHand(skeleton, "right_arm", pairs=()).sweep(q)
    place = skeleton.link_in_thorax(
        q_at(skeleton, q, free.postures[-4]), "right_forearm"
    )[0]
    ball = Capsule("ball", "thorax", tuple(place), tuple(place), 0.03)
    [arm] = [c for c in capsules(skeleton.urdf) if c.link == "right_upper_arm"]
    found = HeldHand(skeleton, "right_arm", pairs=[(arm, ball)]).sweep(q)
    assert found.stops[1] == ("right_upper_arm cylinder touches ball",)
    assert found.length < free.length
    np.testing.assert_allclose(found.postures[0], free.postures[0], atol=END)
    end = q_at(skeleton, q, found.postures[-1])
    # Found to 1e-9 and measured to 1e-5, see above.
    assert gap(skeleton, end, arm, ball) == pytest.approx(0, abs=1e-5)
    for posture in found.postures[:-1]:
        assert gap(skeleton, q_at(skeleton, q, posture), arm, ball) > 0
    Z = free.postures[-1] - free.postures[0]
    reached = available_range(skeleton, q, "right_arm", Z, pairs=[(arm, ball)])
    assert reached.upper == pytest.approx(Z @ found.postures[-1], abs=1e-5)
    assert reached.stops[1] == found.stops[1]


def test_the_trunk_stops_the_upper_arm(skeleton):
    # Hand before the throat: lowering the elbow presses the arm against the ribs.
    q = angles(skeleton, [18, 73, 7, 133, -45, -34, -16])
    alone = HeldHand(skeleton, "right_arm", pairs=()).sweep(q)
    found = HeldHand(skeleton, "right_arm").sweep(q)
    touches = ("right_upper_arm cylinder touches thorax cylinder",)
    assert touches in found.stops
    assert found.length < alone.length - 0.5
    side = found.stops.index(touches)
    end = q_at(skeleton, q, found.postures[(0, -1)[side]])
    pairs = arm_pairs(capsules(skeleton.urdf), ("right",), hands=False)
    rooms = [gap(skeleton, end, *pair) for pair in pairs]
    assert min(rooms) == pytest.approx(0, abs=1e-5)  # see above


def test_more_freedom_gives_a_range_at_least_as_wide(skeleton):
    q = angles(skeleton, POSTURES[1])
    Z = skeleton.null_spaces(q, "right_arm")[0][0]
    seven = available_range(skeleton, q, "right_arm", Z, pairs=())
    wide = available_range(skeleton, q, "right_arm_clavicle", np.r_[0, 0, Z], pairs=())
    position = available_range(skeleton, q, "right_arm", Z, task="position", pairs=())
    assert (seven.freedom, wide.freedom, position.freedom) == (1, 3, 4)
    for more in (wide, position):
        assert more.solved == (True, True)
        assert more.lower < seven.lower < seven.upper < more.upper
    for posture in wide.postures:
        at = q_at(skeleton, q, posture, "right_arm_clavicle")
        places = skeleton.link_in_thorax(np.stack([at, q]), "right_knuckle")[0]
        np.testing.assert_allclose(places[0], places[1], atol=2e-9)


def test_the_range_of_c_is_that_of_the_direction_in_units_of_the_map(
    skeleton, limits_alone
):
    q = angles(skeleton, POSTURES[0])
    x = q[columns(skeleton)]
    Z = skeleton.null_spaces(q, "right_arm")[0][0]
    place = skeleton.link_in_thorax(q, "right_knuckle")[0]
    m, M = Z @ x - 0.3, Z @ x + 0.2
    learned = NullSpaceMap.from_arrays([place], [Z], [m], [M])
    found = available_control(limits_alone, learned, q)
    along = limits_alone.range(q, Z)
    assert found.now == pytest.approx(0.6)
    for end, c in ((along.lower, found.lower), (along.upper, found.upper)):
        assert c == pytest.approx((end - m) / 0.5)
    assert found.share == pytest.approx(0.5 / (along.upper - along.lower))
    for posture, c in zip(
        found.joints.postures, (found.lower, found.upper), strict=True
    ):
        assert learned.control_signal(posture, place) == pytest.approx(c)
    empty = NullSpaceMap.from_arrays([place], [Z], [m], [m])
    with pytest.raises(InvalidInput, match="no range at the hand's place"):
        available_control(limits_alone, empty, q)
    with pytest.raises(InvalidInput, match="freedom from 0 to 0, found 1"):
        available_control(limits_alone, learned, q, dof=1)


def test_the_best_of_random_postures_is_never_better(skeleton):
    q = angles(skeleton, POSTURES[1])
    Z = skeleton.null_spaces(q, "right_arm")[0][0]
    hand = HeldHand(skeleton, "right_arm_clavicle", pairs=())
    direction = np.r_[0, 0, Z]
    found = hand.range(q, direction)
    # Girdle angles on a grid, the arm brought back and swung: all of the freedom.
    arm, best = ArmKinematics(skeleton, "right"), [np.inf, -np.inf]
    goal = skeleton.link_in_thorax(q, "right_knuckle")
    names = columns(skeleton, "right_arm_clavicle")
    for protraction in np.radians([-25, 0, 25]):
        for elevation in np.radians([-10, 10, 30]):
            moved = q.copy()
            moved[names[:2]] = protraction, elevation
            start = arm.to_pose(moved, *goal)
            if (start < skeleton.lower).any() or (start > skeleton.upper).any():
                continue
            for posture in self_motion(arm, start, lowest=-3, highest=3).postures:
                value = direction @ posture
                best = [min(best[0], value), max(best[1], value)]
    assert found.lower <= best[0] < best[1] <= found.upper


def test_the_same_seed_gives_the_same_range(skeleton):
    q = angles(skeleton, POSTURES[2])
    hand = HeldHand(skeleton, "right_arm", task="position")
    one, two = (hand.range(q, np.eye(7)[0], starts=2, seed=3) for _ in range(2))
    assert (one.lower, one.upper) == (two.lower, two.upper)


PLANAR = """<robot name="planar"><link name="l0"/><link name="l1"/><link name="l2"/>
<link name="l3"/><link name="tip"/>
<joint name="a" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
<origin xyz="1 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="c" type="revolute"><parent link="l2"/><child link="l3"/>
<axis xyz="0 0 1"/><origin xyz="0.3 0 0"/>
<limit lower="0.2" upper="2" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="l3"/><child link="tip"/>
<axis xyz="1 0 0"/><limit lower="0.1" upper="2" effort="1" velocity="1"/></joint>
</robot>"""
#: Longest and shortest bar together are shorter than the other two (with the ground, at
#: 1.8 or so, the fourth): Grashof's linkage, whose shortest bar turns all around.
THREE_BARS = """<robot name="bars"><link name="l0"/><link name="l1"/><link name="l2"/>
<link name="l3"/><link name="tip"/>
<joint name="a" type="continuous"><parent link="l0"/><child link="l1"/>
<axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="l1"/><child link="l2"/>
<axis xyz="0 0 1"/><origin xyz="0.3 0 0"/></joint>
<joint name="c" type="continuous"><parent link="l2"/><child link="l3"/>
<axis xyz="0 0 1"/><origin xyz="1.5 0 0"/></joint>
<joint name="end" type="fixed"><parent link="l3"/><child link="tip"/>
<origin xyz="1.2 0 0"/></joint></robot>"""


def test_a_robot_of_turning_and_sliding_joints_has_a_range_too():
    robot = Robot(PLANAR, "tip")
    q = np.array([0.3, 0.4, 0.5, 1.0])
    found = available_range(robot, q, None, [0, 0, 0, 1], task="position")
    # The plane takes two of the four joints; the row of z is always zero.
    assert found.freedom == 2
    assert found.solved == (True, True)
    hold = robot.pose(q)[0]
    for posture in found.postures:
        np.testing.assert_allclose(robot.pose(posture)[0], hold, atol=2e-9)
    # Shortest where the first link points at the tip and c, at its lower limit, makes
    # the most of the rest: 0.3^2 + s^2 + 0.6 s cos 0.2 = (r - 1)^2.
    rest = np.linalg.norm(hold) - 1
    half = 0.3 * np.cos(0.2)
    shortest = -half + np.sqrt(half**2 + rest**2 - 0.09)
    assert found.lower == pytest.approx(shortest, abs=END)
    assert found.stops == (("c at its lower limit",), ("slide at its upper limit",))
    assert found.upper == pytest.approx(2, abs=END)


def test_a_robot_of_seven_joints_sweeps_to_its_limits():
    robot = Robot.load(robots_loader.PandaLoader().df_path, "panda_hand")
    q = np.array([0, 0.3, 0, -1.8, 0, 2.1, 0.5])
    found = HeldHand(robot).sweep(q)
    assert found.solved == (True, True)
    hold = robot.pose(q)
    for posture in found.postures:
        position, rotation = robot.pose(posture)
        np.testing.assert_allclose(position, hold[0], atol=2e-9)
        np.testing.assert_allclose(rotation, hold[1], atol=2e-9)
    for posture, stops in zip(found.postures[[0, -1]], found.stops, strict=True):
        assert stops == ("panda_joint2 at its upper limit",)
        assert posture[1] == pytest.approx(robot.upper[1], abs=END)


def test_a_robot_without_limits_comes_back_to_where_it_began():
    robot = Robot(THREE_BARS, "tip")
    found = HeldHand(robot, task="position").sweep(np.array([0.3, 0.9, 1.6]))
    assert found.stops == (("closed",), ("closed",))
    hold = robot.pose(found.postures[0])[0]
    for posture in found.postures:
        np.testing.assert_allclose(robot.pose(posture)[0], hold, atol=1e-9)


def test_bad_postures_are_refused_with_one_sentence(skeleton, limits_alone):
    q = angles(skeleton, POSTURES[0])
    beyond = q.copy()
    beyond[columns(skeleton)[5]] = np.radians(95)
    with pytest.raises(
        InvalidInput, match=r"right_wrist_flexion at 95 deg, its range being -80 to 90"
    ):
        limits_alone.sweep(beyond)
    robot = Robot(PLANAR, "tip")
    with pytest.raises(InvalidInput, match=r"slide at 3 m, its range being 0\.1 to 2"):
        available_range(robot, [0, 0, 1, 3], None, np.eye(4)[0], task="position")
    for bad in (np.full(18, np.nan), np.zeros((2, 18)), np.zeros(7)):
        with pytest.raises(InvalidInput, match="expected"):
            limits_alone.sweep(bad)
    with pytest.raises(InvalidInput, match=r"expected a finite direction \(7,\)"):
        limits_alone.range(q, np.ones(9))
    with pytest.raises(InvalidInput, match="not zero"):
        limits_alone.range(q, np.zeros(7))
    with pytest.raises(InvalidInput, match="one degree of freedom.*found 4"):
        HeldHand(skeleton, "right_arm", task="position", pairs=()).sweep(q)
    with pytest.raises(InvalidInput, match="unknown chain 'leg'"):
        HeldHand(skeleton, "leg")
    with pytest.raises(InvalidInput, match="name the chain"):
        HeldHand(skeleton)
    inside = Capsule("wall", "thorax", (0, 0, 0), (0, 0, 0), 3.0)
    [arm] = [c for c in capsules(skeleton.urdf) if c.link == "right_upper_arm"]
    with pytest.raises(InvalidInput, match=r"cylinder touches wall, .* mm deep\.$"):
        HeldHand(skeleton, "right_arm", pairs=[(arm, inside)]).sweep(q)


def test_an_arm_at_a_limit_goes_one_way_only(skeleton, limits_alone):
    q = angles(skeleton, POSTURES[0])
    whole = limits_alone.sweep(q)
    half = limits_alone.sweep(q_at(skeleton, q, whole.postures[-1]))
    assert half.solved == (True, True)
    assert whole.stops[1] in half.stops
    assert half.length == pytest.approx(whole.length, rel=0.02)


def test_volumes_are_those_of_the_urdf(skeleton):
    found = {c.name: c for c in capsules(skeleton.urdf)}
    assert found["thorax sphere"].radius == 0.1
    assert {"thorax cylinder", "thorax cylinder 2", "right_hand box 2"} <= set(found)
    pairs = arm_pairs(list(found.values()), ("right", "left"), hands=False)
    assert len(pairs) == 2 * 2 * 3 + 2 * 2
    limb = pairs[0][0]
    assert replace(limb, start=limb.end) == replace(
        found["right_upper_arm cylinder"], start=limb.end
    )
    with pytest.raises(InvalidInput, match="'ball sphere' of the URDF has no finite"):
        capsules(
            '<robot name="r"><link name="ball"><collision><geometry><sphere/>'
            "</geometry></collision></link></robot>"
        )
