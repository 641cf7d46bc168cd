"""A person's motion and a robot's, handed to the comparison as plain arrays.

The person is simulated; the self-motion comes from the Jacobian alone.
"""

import dataclasses
import warnings

import numpy as np
import pytest
import small_person
from example_robot_data import robots_loader

from ikns.analysis.compare import (
    compare,
    compare_combinations,
    compare_motion,
    compare_robot,
    compare_visited,
    motion_crosstalk,
)
from ikns.body.chains import chain_joints
from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.map import NullSpaceMap, analytic_map, null_space_samples
from ikns.numerics.subspace import null_space
from ikns.simulation import explore_null_space

BODY = small_person.protocol().subject.skeleton
TRUTH = small_person.protocol().points.truth


@pytest.fixture(scope="module")
def learned():
    x, q = null_space_samples(TRUTH)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return NullSpaceMap(10).fit(x, q)


@pytest.fixture(scope="module")
def found(learned):
    return {
        key: compare_motion(learned, BODY, TRUTH, resamples=0, **options)
        for key, options in {
            "pose": {},
            "position": {"task": "position"},
            "clavicle": {"analyzed": "right_arm_clavicle"},
            "isb": {"coordinates": "isb"},
            "vector": {"coordinates": "rotation_vector"},
        }.items()
    }


def test_what_was_learned_from_true_angles_is_near_the_true_null_space(found):
    pose = found["pose"]
    assert pose.null_dim == 1
    # Drift of the hand (4 mm, 1.2 deg) and 1.5 s a point leave some degrees; a random
    # direction is farther away than 45 deg in 19 of 20 cases.
    assert np.degrees(pose.angles).max() < 15
    assert pose.inside.min() > 0.8
    assert pose.angles.max() < pose.chance_angles[0]


def test_the_null_space_of_the_position_contains_that_of_the_pose(found):
    pose, position = found["pose"], found["position"]
    assert position.null_dim == 4
    # At one posture exactly; an average over postures is not that strict.
    assert (
        position.mean_posture_angles[:, 0] <= pose.mean_posture_angles[:, 0] + 1e-9
    ).all()
    assert (position.inside_mean_posture >= pose.inside_mean_posture - 1e-9).all()
    # How the hand follows c does not depend on what it was meant to hold.
    np.testing.assert_allclose(position.leak, pose.leak, rtol=1e-12)


def test_with_the_clavicle_there_are_two_more_dimensions(found):
    clavicle = found["clavicle"]
    assert clavicle.null_dim == 3
    assert clavicle.directions.shape == (10, 1, 9)
    # Signs are those of the map, whose seven joints are the last of the nine.
    own = found["pose"].directions[:, 0]
    assert (np.sum(clavicle.directions[:, 0, 2:] * own, axis=1) > 0.9).all()


def test_self_motion_is_bent_in_isb_angles_and_straighter_in_rotation_vectors(found):
    straight = {key: each.pooled["straight_leak"][0] for key, each in found.items()}
    # urdf/README: internal angles were chosen because they bend less than a third as
    # much as ISB's.
    assert straight["vector"] < straight["pose"] < straight["isb"] / 1.5


def test_other_coordinates_describe_the_same_hand(found):
    # c is learned again in each, so the slopes agree only as far as c does.
    np.testing.assert_allclose(found["vector"].leak, found["pose"].leak, rtol=0.2)
    assert (found["vector"].agreement > 0.99).all()


def at_point(point):
    """The truth while the hand is held at one point."""
    here = small_person.protocol().points.point == point
    return dataclasses.replace(
        TRUTH,
        **{
            field.name: getattr(TRUTH, field.name)[here]
            for field in dataclasses.fields(TRUTH)
            if isinstance(getattr(TRUTH, field.name), np.ndarray)
        },
    )


def test_points_that_were_not_visited_are_left_out(learned):
    part = at_point(4)
    found = compare_motion(learned, BODY, part, resamples=0)
    assert len(found.points) == 1
    place = part.task_position("right_arm").mean(axis=0)
    # The point of the map that lies where the hand was held, half a meter from others.
    assert np.linalg.norm(learned.centers_[found.points[0]] - place) < 0.05


def test_a_map_is_compared_with_the_analytic_one_at_the_visited_points(learned):
    every = compare_visited(learned, BODY, TRUTH)
    assert every.points.tolist() == list(range(10))
    reference = learned.directions_.sum(axis=0)
    analytic = analytic_map(
        BODY,
        TRUTH,
        learned.centers_,
        radius=learned.radius_,
        reference=reference,
    )
    expected = compare(learned, analytic, TRUTH)
    np.testing.assert_array_equal(every.comparison.angles, expected.angles)
    np.testing.assert_array_equal(every.comparison.counts, every.counts)
    part = compare_visited(learned, BODY, at_point(4))
    assert len(part.points) == 1
    assert part.counts.sum() == part.counts[part.points[0]] > 0
    np.testing.assert_array_equal(
        part.learned.directions_, learned.directions_[part.points]
    )


def test_combinations_are_the_comparisons_one_by_one(learned, found):
    made = compare_combinations(
        learned,
        BODY,
        TRUTH,
        chains=("right_arm", "right_arm_clavicle"),
        tasks=("pose",),
        coordinates=("internal", "isb"),
        resamples=0,
    )
    chains = ("right_arm", "right_arm_clavicle")
    assert list(made.found) == [
        (chain, "pose", name) for chain in chains for name in ("internal", "isb")
    ]
    assert not made.left_out
    for chain, name, key in (
        ("right_arm", "internal", "pose"),
        ("right_arm", "isb", "isb"),
        ("right_arm_clavicle", "internal", "clavicle"),
    ):
        one = made.found[chain, "pose", name]
        np.testing.assert_array_equal(one.angles, found[key].angles)


def test_a_chain_that_cannot_be_compared_is_left_out_unless_it_is_the_maps(learned):
    q = np.array(TRUTH.q)
    joint = chain_joints("right_arm_clavicle")[0]
    q[:, 7 + TRUTH.joint_names.index(joint)] = 0.1
    stuck = dataclasses.replace(TRUTH, q=q)
    chains = ("right_arm", "right_arm_clavicle")
    made = compare_combinations(learned, BODY, stuck, chains=chains, resamples=0)
    assert [chain for chain, _, _ in made.found] == ["right_arm"] * 2
    assert "the 1. of 9 constant" in made.left_out["right_arm_clavicle"]
    with pytest.raises(NotEnoughData, match="slower than 1e-09 m/s"):
        compare_combinations(learned, BODY, TRUTH, max_hand_speed=1e-9)


def test_crosstalk_is_that_of_the_map_on_the_reaches(learned):
    free = small_person.protocol().points.truth
    found = motion_crosstalk(learned, free)
    c = learned.control_signal(
        free.chain_angles("right_arm"), free.task_position("right_arm")
    )
    before, after = found.reaches.T
    np.testing.assert_array_equal(found.change, c[after] - c[before])
    assert len(found.change) == 9  # between ten points


def test_chains_and_maps_that_do_not_fit_are_reported(learned):
    with pytest.raises(InvalidInput, match="ends in the right hand"):
        compare_motion(learned, BODY, TRUTH, analyzed="left_arm")
    with pytest.raises(InvalidInput, match="unknown chain 'leg'"):
        compare_motion(learned, BODY, TRUTH, analyzed="leg")
    with pytest.raises(InvalidInput, match="right_arm_clavicle with 9 joints"):
        compare_motion(learned, BODY, TRUTH, chain="right_arm_clavicle")
    with pytest.raises(InvalidInput, match="unknown coordinates"):
        compare_motion(learned, BODY, TRUTH, coordinates="quaternions")
    with pytest.raises(NotEnoughData, match="slower than 1e-09 m/s"):
        compare_motion(learned, BODY, TRUTH, max_hand_speed=1e-9)
    far = NullSpaceMap.from_arrays(
        learned.centers_ + 9, learned.directions_, learned.lower_, learned.upper_
    )
    far.radius_ = 0.1
    with pytest.raises(NotEnoughData, match="near a PCA point, found 0"):
        compare_motion(far, BODY, TRUTH)


def test_a_joint_that_no_marker_shows_is_reported(learned):
    q = np.array(TRUTH.q)
    joint = chain_joints("right_arm_clavicle")[0]
    q[:, 7 + TRUTH.joint_names.index(joint)] = 0.1
    stuck = dataclasses.replace(TRUTH, q=q)
    with pytest.raises(NotEnoughData, match="the 1. of 9 constant"):
        compare_motion(learned, BODY, stuck, analyzed="right_arm_clavicle")


# --- any robot ------------------------------------------------------------------------


def planar(n):
    """An arm of n links of 0.4 m whose joints turn about Z."""
    links = "".join(f'<link name="l{i}"/>' for i in range(n + 2))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" '
        f'effort="1" velocity="1"/><origin xyz="{0.4 * (i > 0)} 0 0"/></joint>'
        for i in range(n)
    )
    tip = (
        f'<joint name="tip" type="fixed"><parent link="l{n}"/><child link="l{n + 1}"/>'
        '<origin xyz="0.4 0 0"/></joint>'
    )
    return f'<robot name="planar">{links}{joints}{tip}</robot>'


def test_a_robot_that_follows_its_null_space_is_found_inside_it():
    robot = Robot(planar(3), "l4")
    q, null = [np.array([0.3, 0.9, -0.7])], np.ones(3)
    for step in np.repeat([1, -1, -1, 1], 60) * 0.004:
        # Of the planar position only two rows are not zero; rank 2, one null vector.
        basis = null_space(robot.jacobian(q[-1], task="position")[:2])[0]
        null = basis * np.sign(basis @ null)
        q.append(q[-1] + step * null)
    q = np.array(q)
    time = np.arange(len(q)) / 50
    x, _ = robot.pose(q)
    mapped = NullSpaceMap(1).fit(x, q)
    found = compare_robot(mapped, robot, time, q, task="position", resamples=0)
    assert found.null_dim == 1
    # The null vector turns by `curvature`; a chord stays within half of that of all.
    assert found.angles[0, 0] < found.curvature[0] / 2
    assert found.inside[0] > np.cos(found.curvature[0]) ** 2
    # Steps of 0.004 rad along a tangent leave the curve by 0.004^2 / 2 times curvature
    # (of the order of 1/rad) times 0.4 m: 3 um each, 240 of them at the very most.
    assert found.leak[0, 0] < 240 * 3e-6
    with pytest.raises(InvalidInput, match=r"joint angles \(T, 3\)"):
        compare_robot(mapped, robot, time, q[:, :2])
    with pytest.raises(NotEnoughData, match="slower than"):
        compare_robot(mapped, robot, time, q * 50, max_hand_speed=1e-6)


def test_a_real_arm_that_holds_its_tool_neither_leaks_nor_turns():
    loader = robots_loader.PandaLoader()
    robot = Robot.load(loader.df_path, "panda_hand_tcp")
    start = np.array(loader.robot.q0)[: len(robot.joint_names)]
    time, q = explore_null_space(robot, start, seconds=4, seed=1)
    mapped = NullSpaceMap(1).fit(robot.pose(q)[0], q)
    pose, position = (
        compare_robot(mapped, robot, time, q, task=task, resamples=50)
        for task in ("pose", "position")
    )
    assert (pose.null_dim, position.null_dim) == (1, 4)
    # The tool is put back to 1e-10 at every sample, while c goes from 0 to 1.
    assert pose.leak[0, 0] < 1e-8
    assert pose.turn[0, 0] < 1e-8
    # A straight line stays within the angle that the curve turns by.
    assert pose.angles[0, 0] < pose.curvature[0]
    assert position.mean_posture_angles[0, 0] <= pose.mean_posture_angles[0, 0]


def test_a_robot_frame_that_no_joint_moves_is_reported():
    with pytest.raises(InvalidInput, match="found none"):
        Robot(planar(3), "l0")
