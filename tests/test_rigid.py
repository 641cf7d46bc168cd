"""Rotations and distances against SciPy's, which takes a while to import."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from ikns.numerics.cross_product import cross
from ikns.numerics.distance import distances
from ikns.numerics.rigid import aligned, pose_steps, quaternion_matrix, turn_matrix

SEEDS = st.integers(0, 2**32 - 1)
#: A handful of products of numbers of at most 1 are off by less than ten roundings.
ROUNDING = 10 * np.finfo(float).eps


@given(SEEDS)
def test_a_quaternion_is_scipys_rotation(seed: int) -> None:
    quaternion = np.random.default_rng(seed).normal(size=4)
    np.testing.assert_allclose(
        quaternion_matrix(quaternion),
        Rotation.from_quat(quaternion).as_matrix(),
        rtol=0,
        atol=ROUNDING,
    )


@given(SEEDS, st.integers(3, 8), st.floats(0, 0.9))
def test_moved_points_return_by_those_that_are_seen(seed: int, n: int, gaps: float):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    turns = Rotation.from_quat(rng.normal(size=(9, 4))).as_matrix()
    frames = points @ np.swapaxes(turns, 1, 2) + rng.normal(size=(9, 1, 3))
    frames[rng.random((9, n)) < gaps] = np.nan
    back = aligned(frames, points)
    seen = np.isfinite(frames).all(axis=2)
    for frame, own in zip(back, seen, strict=True):
        if own.sum() < 3:
            assert np.isnan(frame).all()
            continue
        # Three points in almost one line turn easily: by rounding over their width.
        width = np.linalg.svd(points[own] - points[own].mean(axis=0))[1][1]
        tolerance = 10 * ROUNDING * max(1.0, np.abs(points).max() / width) ** 2
        np.testing.assert_allclose(frame[own], points[own], rtol=0, atol=tolerance)
        assert np.isnan(frame[~own]).all()


@given(SEEDS, st.floats(-np.pi, np.pi))
def test_a_turn_is_the_exponential_of_its_axis(seed: int, angle: float) -> None:
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    across = np.cross(np.eye(3), axis)  # across @ v is axis x v
    # The series of the exponential loses some digits: its terms reach pi**3 / 6.
    np.testing.assert_allclose(
        turn_matrix(axis, angle), expm(angle * across), rtol=0, atol=10 * ROUNDING
    )


@pytest.mark.parametrize("size", [3.0, 1e-2, 1e-5, 1e-12, 0.0])
@given(seed=SEEDS)
def test_a_step_leads_from_a_pose_to_the_next(size: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    turns = [Rotation.from_quat(draw.normal(size=4))]
    for _ in range(5):
        turns.append(turns[-1] * Rotation.from_rotvec(size * draw.normal(size=3)))
    # A quaternion and its negative are the same rotation.
    quaternions = [draw.choice([-1, 1]) * turn.as_quat() for turn in turns]
    places = draw.normal(size=(6, 3))
    steps = pose_steps(np.hstack([places, quaternions]))
    for k, step in enumerate(steps):
        twist = np.zeros((4, 4))
        twist[:3, :3] = np.cross(np.eye(3), step[3:])
        twist[:3, 3] = step[:3]
        made = expm(twist)
        between = turns[k].inv() * turns[k + 1]
        np.testing.assert_allclose(
            made[:3, :3], between.as_matrix(), rtol=0, atol=100 * ROUNDING
        )
        # Ten times the places' size, products with vectors of up to pi, and expm.
        np.testing.assert_allclose(
            made[:3, 3],
            turns[k].inv().apply(places[k + 1] - places[k]),
            rtol=0,
            atol=1e4 * ROUNDING,
        )


POINTS = arrays(
    np.float64, st.tuples(st.integers(0, 6), st.just(3)), elements=st.floats(-9, 9)
)


@given(POINTS, POINTS)
def test_distances_are_scipys(a: np.ndarray, b: np.ndarray) -> None:
    np.testing.assert_array_max_ulp(distances(a, b), cdist(a, b), maxulp=2)


@pytest.mark.parametrize("shapes", [((3,), (3,)), ((5, 3), (3,)), ((2, 1, 3), (4, 3))])
def test_cross_products_are_numpys(shapes: tuple) -> None:
    draw = np.random.default_rng(0)
    a, b = (draw.normal(size=shape) for shape in shapes)
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
