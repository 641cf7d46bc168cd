import numpy as np
import pytest

from ikns.analysis.compare import compare
from ikns.body.chains import SIDES, chain_joints
from ikns.errors import InvalidInput
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap

CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=float) * 0.3
JOINTS = chain_joints("right_arm")
N = 60


def motion_along(directions, spread, leak, rng):
    """Still samples at eight corners: joints along a direction, the hand leaking."""
    x, q = [], []
    for corner, z in zip(CORNERS, directions, strict=True):
        s = np.linspace(-0.5, 0.5, N)
        q.append(np.outer(s, z) + spread * rng.normal(size=(N, 7)))
        x.append(corner + np.outer(s, leak))
    x, q = np.concatenate(x), np.concatenate(q)
    t = len(x)
    hand = np.zeros((t, 2, 3))
    hand[:, SIDES.index("right")] = x
    return Motion(
        time=np.arange(t) / 100,
        q=q,
        v=np.zeros_like(q),
        joint_names=JOINTS,
        hand_in_thorax=hand,
        hand_rotation_in_thorax=np.tile(np.eye(3), (t, 2, 1, 1)),
        hand_velocity_in_thorax=np.zeros((t, 2, 3)),
        residual=np.zeros(t),
        iterations=np.ones(t, dtype=int),
        converged=np.ones(t, dtype=bool),
    )


def rotated(z, angle, rng):
    """A unit vector at this angle from z."""
    across = rng.normal(size=z.shape)
    across -= z * (across @ z)
    return np.cos(angle) * z + np.sin(angle) * across / np.linalg.norm(across)


@pytest.fixture
def planted():
    rng = np.random.default_rng(0)
    z = rng.normal(size=7)
    z /= np.linalg.norm(z)
    directions = np.tile(z, (8, 1))
    motion = motion_along(directions, 0.0, np.array([0.0, 0.02, 0.0]), rng)
    return motion, directions, rng


def mapped(directions):
    return NullSpaceMap.from_arrays(
        CORNERS, directions, np.full(8, -0.5), np.full(8, 0.5), radius=0.1
    )


def test_a_map_agrees_with_itself(planted):
    motion, directions, _ = planted
    report = compare(mapped(directions), mapped(directions), motion)
    # Rounding of an arcsine.
    np.testing.assert_allclose(report.angles, 0, atol=1e-7)
    np.testing.assert_allclose(report.inside, 1, atol=1e-12)
    np.testing.assert_allclose(report.agreement, 1, atol=1e-12)
    np.testing.assert_array_equal(report.counts, N)


def test_planted_angle_and_share_of_variance_come_out(planted):
    motion, directions, rng = planted
    angle = np.radians(25)
    other = np.stack([rotated(z, angle, rng) for z in directions])
    report = compare(mapped(directions), mapped(other), motion)
    np.testing.assert_allclose(report.angles[:, 0], angle, atol=1e-9)
    # Motion on a line: its variance along another line is the squared cosine.
    np.testing.assert_allclose(report.inside, np.cos(angle) ** 2, atol=1e-9)


def test_leak_is_the_hand_displacement_per_unit_of_c(planted):
    motion, directions, _ = planted
    report = compare(mapped(directions), mapped(directions), motion)
    # The hand moves 20 mm while s, and with it c, goes through one unit.
    np.testing.assert_allclose(report.learned_leak, 0.02, atol=1e-9)
    # A straight line leaves nothing to doubt, and the hand does not turn.
    np.testing.assert_allclose(report.learned_leak_interval, 0.02, atol=1e-9)
    np.testing.assert_allclose(report.learned_turn, 0, atol=1e-12)


def test_maps_of_different_points_are_refused(planted):
    motion, directions, _ = planted
    other = NullSpaceMap.from_arrays(
        CORNERS + 0.1, directions, np.full(8, -0.5), np.full(8, 0.5)
    )
    with pytest.raises(InvalidInput, match="the same PCA points"):
        compare(mapped(directions), other, motion)
