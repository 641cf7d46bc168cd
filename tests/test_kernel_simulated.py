"""Kernels of simulated people against NumPy, SciPy and Pinocchio."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from ikns._kernels.body.simulated_markers import (
    write_cubic,
    write_markers,
    write_posture,
)
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.simulation.arm import POSE_TOLERANCE, ArmKinematics

SEEDS = st.integers(0, 2**32 - 1)
BODY = Skeleton.load()


def newton(arm: ArmKinematics, angles, position, rotation) -> np.ndarray:
    """Do the same with the pseudo-inverse, by singular values."""
    angles = np.array(angles)
    for _ in range(50):
        p, R = arm.hand(angles)
        D = rotation @ R.T
        turn = np.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]]) / 2
        error = np.append(position - p, turn)
        if np.abs(error).max() < POSE_TOLERANCE:
            return angles
        step = np.linalg.pinv(BODY.chain_jacobian(angles, arm.chain)) @ error
        angles[arm.columns[2:]] += step * min(1.0, 0.3 / np.abs(step).max())
    raise AssertionError("not reached")


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, side=st.sampled_from(["right", "left"]))
def test_a_pose_is_reached_by_the_shortest_steps(seed: int, side: str) -> None:
    rng = np.random.default_rng(seed)
    arm = ArmKinematics(BODY, side)
    usual = np.array([0.0, 0.0, 0.4, 0.6, 0.0, 1.4, 0.0, 0.0, 0.0])
    near = arm.put(np.zeros(18), usual + rng.normal(0.0, 0.1, 9))
    goal = arm.hand(arm.put(near, near[arm.columns] + rng.normal(0.0, 0.2, 9)))
    found = arm.to_pose(near, *goal)
    # Rounding of 1e-16 through at most 50 steps with a Jacobian whose condition is
    # below 1e4 here; squared by the normal equations.
    np.testing.assert_allclose(found, newton(arm, near, *goal), atol=1e-7)
    p, R = arm.hand(found)
    np.testing.assert_allclose(p, goal[0], atol=2 * POSE_TOLERANCE)
    np.testing.assert_allclose(R, goal[1], atol=2 * POSE_TOLERANCE)
    others = np.delete(np.arange(18), arm.columns[2:])
    np.testing.assert_array_equal(found[others], near[others])


def test_many_poses_are_those_of_one_each_and_a_far_one_is_named() -> None:
    arm = ArmKinematics(BODY, "right")
    near = np.array([arm.put(np.zeros(18), [0, 0, 0.4, 0.6, 0, 1.4, 0, 0, 0])] * 3)
    hands = [arm.hand(row) for row in near + 0.02 * np.arange(3)[:, None]]
    p, R = np.array([p for p, _ in hands]), np.array([R for _, R in hands])
    before = near.copy()
    many = arm.to_poses(near, p, R)
    one = [arm.to_pose(*each) for each in zip(near, p, R, strict=True)]
    np.testing.assert_array_equal(many, one)
    np.testing.assert_array_equal(near, before)
    p[1] = [3.0, 0.0, 0.5]
    with pytest.raises(
        InvalidInput, match=r"right hand cannot be .* \[3\. +0\. +0\.5\]"
    ):
        arm.to_poses(near, p, R)


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, x=st.floats(-2.0, 3.0))
def test_a_cubic_is_scipys(seed: int, x: float) -> None:
    rng = np.random.default_rng(seed)
    knots = np.sort(rng.uniform(0.0, 1.0, 6)) + 0.01 * np.arange(6)
    spline = CubicSpline(knots, rng.normal(size=(6, 4)))
    values = np.empty(4)
    write_cubic(np.array(spline.x), np.array(spline.c), x, values)
    size = np.abs(spline.c).max() * (1 + abs(x - knots[0])) ** 3
    np.testing.assert_allclose(values, spline(x), atol=1e-14 * size)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_markers_are_pinocchios_moved_by_skin_and_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = BODY.neutral()
    q[:3], q[7:] = rng.normal(size=3), rng.uniform(-0.6, 0.6, 18)
    q[3:7] = rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    joint, in_joint = BODY.tree_markers
    skin, noise = rng.normal(size=(2, len(joint), 3))
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    joints = len(BODY.joint_names) + 1
    markers = np.empty((len(joint), 3))
    work = np.empty((2, 25)), np.empty((joints, 3, 3)), np.empty((joints, 3))
    write_markers(
        BODY.tree, q, joint, in_joint, skin.ravel(), turned, noise, *work, markers
    )
    expected = BODY.markers_in_world(q) + skin @ turned.T + noise
    np.testing.assert_allclose(markers, expected, atol=1e-13)  # sizes of a few m


def test_a_posture_is_the_row_and_what_the_drift_adds() -> None:
    rng = np.random.default_rng(0)
    row, drift, q = rng.normal(size=60), rng.normal(size=6), rng.normal(size=25)
    columns = rng.permutation(18)[:9]
    expected = q.copy()
    expected[7 + columns] = row[:9]
    expected[7 + columns[2:]] += row[9:51].reshape(7, 6) @ drift
    write_posture(columns, row, drift, q)
    np.testing.assert_allclose(q, expected, atol=1e-14)
