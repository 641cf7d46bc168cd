"""The hinge swivel against an arm that is built here, with numpy alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import FORWARD, arm_swivel, hinge_swivel

angle = st.floats(-np.pi, np.pi)
positive = st.floats(0.05, np.pi - 0.05)


def turn(axis, by):
    """Rotation matrix about an axis (Rodrigues)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(by) * k + (1 - np.cos(by)) * k @ k


def arm(R, flexion):
    """Shoulder, elbow, wrist and hinge of an arm of two bars with upper arm R."""
    shoulder = np.array([0.02, -0.03, 0.17])
    elbow = shoulder + R @ [0, -0.29, 0]
    wrist = elbow + R @ turn([0, 0, 1], flexion) @ [0, -0.25, 0]
    return shoulder, elbow, wrist, R @ [0, 0, 1]


def planar(shoulder, elbow, wrist):
    """Swivel of joint centers: elbow's direction across the line, from a reference.

    Without carrying angle the elbow lies in the plane of the hinge, so both agree.
    """
    n = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    across = (elbow - shoulder) - ((elbow - shoulder) @ n) * n
    axis = np.cross(FORWARD, n)
    down = np.array([0, -1.0, 0]) - (-FORWARD[1]) * FORWARD
    carried = turn(axis, np.arctan2(np.linalg.norm(axis), FORWARD @ n)) @ down
    sine = np.cross(n, carried) @ across
    return np.arctan2(-sine, carried @ across)


@given(angle, angle, angle, st.floats(0.1, 2.5))
@settings(max_examples=40, deadline=None)
def test_it_is_the_swivel_of_an_arm_of_two_bars(a, b, c, flexion):
    R = turn([1, 0, 0], a) @ turn([0, 0, 1], b) @ turn([0, 1, 0], c)
    shoulder, elbow, wrist, hinge = arm(R, flexion)
    n = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    if 1 + n @ FORWARD < 1e-3:  # behind the shoulder it is undefined
        return
    difference = hinge_swivel(shoulder, wrist, hinge) - planar(shoulder, elbow, wrist)
    # Rounding of 1e-16 over 1 + n.f > 1e-3 and sin(flexion) lengths > 1e-2.
    assert abs(np.angle(np.exp(1j * difference))) < 1e-9


@given(angle, angle, angle, st.floats(0.0, 2.5), angle)
@settings(max_examples=40, deadline=None)
def test_along_the_self_motion_it_changes_by_the_turn(a, b, c, flexion, by):
    R = turn([1, 0, 0], a) @ turn([0, 0, 1], b) @ turn([0, 1, 0], c)
    shoulder, _, wrist, hinge = arm(R, flexion)
    n = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    if 1 + n @ FORWARD < 1e-3:
        return
    before, after = (
        hinge_swivel(shoulder, wrist, hinge_now)
        for hinge_now in (hinge, turn(n, by) @ hinge)
    )
    # A right arm turns outwards by the left-hand rule about the line to the wrist.
    assert abs(np.angle(np.exp(1j * (after - before + by)))) < 1e-9


def test_it_rises_with_the_elbow():
    # Hand ahead of the shoulder: elbow below at first, then lifted to the right.
    down = hinge_swivel([0, 0, 0], [0.4, 0, 0], [0, 0, 1])
    out = hinge_swivel([0, 0, 0], [0.4, 0, 0], [0, 1, 0])
    assert np.isclose(out - down, np.pi / 2)
    assert abs(down) < np.radians(5)  # the reference is carried, not exactly down


@given(angle, angle, angle, st.floats(0.1, 2.5))
@settings(max_examples=30, deadline=None)
def test_a_mirrored_arm_has_the_same_swivel(a, b, c, flexion):
    R = turn([1, 0, 0], a) @ turn([0, 0, 1], b) @ turn([0, 1, 0], c)
    shoulder, _, wrist, hinge = arm(R, flexion)
    mirror = np.array([1.0, 1.0, -1.0])
    left = hinge_swivel(shoulder * mirror, wrist * mirror, -hinge * mirror, side="left")
    right = hinge_swivel(shoulder, wrist, hinge)
    assert np.isclose(left, right, rtol=0, atol=1e-12) or np.isnan(right)


def test_the_same_posture_of_both_arms_of_the_body_is_the_same():
    rng = np.random.default_rng(1)
    body = Skeleton.load()
    q = np.zeros((20, 18))
    for j, name in enumerate(body.joint_names):
        if name.startswith("right"):
            q[:, j] = rng.uniform(0.1, 0.9, 20)
            q[:, body.joint_names.index(name.replace("right", "left"))] = q[:, j]
    right, left = (arm_swivel(body, q, f"{side}_arm") for side in ("right", "left"))
    assert np.allclose(right[0], left[0], atol=1e-12)
    assert np.allclose(right[1], left[1], atol=1e-12)
    # The wrist joints and pronation have no say.
    moved = q.copy()
    for joint in ("forearm_pronation", "wrist_flexion", "wrist_deviation"):
        moved[:, body.joint_names.index(f"right_{joint}")] -= 0.5
    same = arm_swivel(body, moved, "right_arm")
    # Pronation turns about the line from elbow to wrist, which stays.
    assert np.allclose(same[0], right[0], atol=1e-12)
    assert np.allclose(same[1], right[1], atol=1e-12)


def test_what_is_undefined_is_nan():
    assert np.isnan(hinge_swivel([0, 0, 0], -0.4 * FORWARD, [0, 0, 1]))
    assert np.isnan(hinge_swivel([0, 0, 0], [0.4, 0, 0], [1, 0, 0]))
    assert np.isnan(hinge_swivel([0, 0, 0], [0, 0, 0], [0, 0, 1]))
    assert np.isnan(hinge_swivel([0, 0, np.nan], [0.4, 0, 0], [0, 0, 1]))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(side="both"), "'right' or 'left'"),
        (dict(wrist_in_thorax=[0.1, 0.2]), r"\(\.\.\., 3\)"),
    ],
)
def test_what_is_not_an_arm_is_refused(arguments, words):
    given_ = dict(
        shoulder_in_thorax=[0, 0, 0],
        wrist_in_thorax=[0.4, 0, 0],
        hinge_axis_in_thorax=[0, 0, 1],
    )
    with pytest.raises(InvalidInput, match=words):
        hinge_swivel(**(given_ | arguments))


def test_two_arms_have_two_swivels():
    with pytest.raises(InvalidInput, match="one arm"):
        arm_swivel(Skeleton.load(), np.zeros(18), "both_arms")
