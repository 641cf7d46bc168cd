"""Interpolation schemes of the benchmark: what each promises, and means of subspaces.

Tolerance, unless a test says otherwise: sums of ten terms of order 1, divided by
volumes that cancel at most a thousandfold, are known to 10 * 1.1e-16 * 1e3 = 1e-12.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import subspace_angles

from ikns.nullspace.map import NullSpaceMap

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from interpolation.grassmann import exponential, logarithm, mean_subspace
from interpolation.schemes import CONVEX, LINEAR, PAPER, SCHEMES, THROUGH, Known

ROUNDING = 1e-12
seeds = st.integers(0, 2**32 - 1)


def sites(rng, n=10):
    """A box with face centers, a little off: the paper's layout."""
    cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    box = np.vstack([cube, [[0.5, 1.0, 0.5], [0.5, 0.0, 0.5]]])[:n]
    return box * [0.2, 0.35, 0.36] + rng.normal(0.0, 0.012, (n, 3))


def inside(points, rng, n=30):
    return rng.dirichlet(np.ones(len(points)), n) @ points


def subspace(rng, d, n=7, near=None, spread=0.3):
    """Orthonormal rows at random, or near others."""
    rows = rng.normal(size=(d, n)) if near is None else near
    if near is not None:
        rows = rows + spread * rng.normal(size=(d, n)) / np.sqrt(n)
    return np.linalg.qr(rows.T)[0].T


def some_known(rng, d=1):
    """Directions near each other, with agreeing bases, and ranges."""
    points, middle = sites(rng), subspace(rng, d)
    directions = []
    for _ in points:
        z = subspace(rng, d, near=middle)
        u, _, vt = np.linalg.svd(middle @ z.T)
        directions.append(u @ vt @ z)
    lower = rng.uniform(-1.0, 0.0, (len(points), d))
    return Known(
        directions=np.array(directions),
        lower=lower,
        upper=lower + rng.uniform(0.5, 1.5, lower.shape),
        centers=points,
        postures=rng.normal(size=(len(points), 7)),
    )


def of_values(points, values):
    """Values (P, K) in the place of a direction."""
    zero = np.zeros((len(points), 1))
    return Known(
        directions=values[:, None],
        lower=zero,
        upper=zero + 1.0,
        centers=points,
        postures=np.zeros_like(values),
    )


def projector(rows):
    return np.swapaxes(rows, -1, -2) @ rows


@pytest.mark.parametrize("d", [1, 2])
@pytest.mark.parametrize("name", THROUGH)
def test_at_a_point_stands_what_was_learned_there(name, d):
    known = some_known(np.random.default_rng(1), d)
    found = SCHEMES[name](known)(known.centers)
    # A thin-plate system of ten points has a condition of some 1e4: 1e-16 * 1e4 and
    # room. The Grassmann mean stops at steps of 1e-12.
    for part in ("directions", "lower", "upper"):
        np.testing.assert_allclose(
            getattr(found, part), getattr(known, part), atol=1e-10, rtol=0
        )


@pytest.mark.parametrize("name", CONVEX)
def test_weights_are_at_least_zero_and_sum_to_one(name):
    rng = np.random.default_rng(2)
    points = sites(rng)
    at = SCHEMES[name](of_values(points, np.eye(len(points))))
    around = rng.uniform(-0.3, 0.7, (50, 3))
    weights = at(np.vstack([inside(points, rng), around])).directions[:, 0]
    assert weights.min() >= -ROUNDING
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=ROUNDING)


@pytest.mark.parametrize("name", LINEAR)
def test_what_is_linear_in_space_stays_so_inside_the_hull(name):
    rng = np.random.default_rng(3)
    points = sites(rng)
    slope, level = rng.normal(size=(3, 5)), rng.normal(size=5)
    at = SCHEMES[name](of_values(points, points @ slope + level))
    x = inside(points, rng)
    # 1e-10 for the thin plate's system, see above.
    np.testing.assert_allclose(
        at(x).directions[:, 0], x @ slope + level, atol=1e-10, rtol=0
    )


@pytest.mark.parametrize("name", SCHEMES)
def test_equal_points_make_an_equal_everywhere(name):
    rng = np.random.default_rng(4)
    one = some_known(rng)
    same = Known(
        directions=np.repeat(one.directions[:1], 10, axis=0),
        lower=np.repeat(one.lower[:1], 10, axis=0),
        upper=np.repeat(one.upper[:1], 10, axis=0),
        centers=one.centers,
        postures=np.repeat(one.postures[:1], 10, axis=0),
    )
    x, q = rng.uniform(-0.1, 0.5, (20, 3)), rng.normal(size=(20, 7))
    along = q @ same.directions[0, 0]
    c = (along - same.lower[0]) / (same.upper[0] - same.lower[0])
    # Thin plate: 1e-10 as above, over a range of at least 0.5.
    np.testing.assert_allclose(
        SCHEMES[name](same)(x).signal(q)[:, 0], c, atol=1e-9, rtol=0
    )


@given(seed=seeds, d=st.sampled_from([1, 2]))
@settings(max_examples=20, deadline=None)
def test_the_papers_scheme_is_the_map_of_the_package(seed, d):
    rng = np.random.default_rng(seed)
    known = some_known(rng, d)
    learned = NullSpaceMap.from_arrays(
        known.centers, known.directions, known.lower, known.upper
    )
    x, q = rng.uniform(-0.1, 0.5, (20, 3)), rng.normal(size=(20, 7))
    c = SCHEMES[PAPER](known)(x).signal(q)
    expected = learned.control_signal(q, x).reshape(20, d)
    np.testing.assert_allclose(c, expected, atol=ROUNDING, rtol=ROUNDING)


@pytest.mark.parametrize("name", ["Grassmann, projected", "centered, projected"])
def test_the_middle_of_a_range_between_equal_postures_has_c_one_half(name):
    rng = np.random.default_rng(5)
    some = some_known(rng)
    q = np.repeat(rng.normal(size=(1, 7)), 10, axis=0)
    along = np.einsum("pdk,pk->pd", some.directions, q)
    known = Known(some.directions, along - 0.4, along + 0.4, some.centers, q)
    c = SCHEMES[name](known)(inside(some.centers, rng)).signal(
        np.repeat(q[:1], 30, axis=0)
    )
    np.testing.assert_allclose(c, 0.5, atol=ROUNDING)


def test_leaving_a_point_out_leaves_the_others():
    known = some_known(np.random.default_rng(6))
    rest = known.without(3)
    kept = np.delete(np.arange(10), 3)
    for part in ("centers", "directions", "lower", "upper", "postures"):
        np.testing.assert_array_equal(getattr(rest, part), getattr(known, part)[kept])


# --- means of subspaces ---------------------------------------------------------------


@given(seed=seeds, d=st.integers(1, 3))
@settings(max_examples=50, deadline=None)
def test_the_exponential_undoes_the_logarithm(seed, d):
    rng = np.random.default_rng(seed)
    X, Y = subspace(rng, d), subspace(rng, d)
    there = exponential(X, logarithm(X, Y))
    # Near a right angle the shorter way is decided by a cosine of 1e-16 over the sine
    # of the angle left; angles at random are far from it.
    np.testing.assert_allclose(projector(there), projector(Y), atol=1e-10)


@given(seed=seeds, d=st.integers(1, 3))
@settings(max_examples=50, deadline=None)
def test_the_logarithm_is_as_long_as_the_principal_angles(seed, d):
    rng = np.random.default_rng(seed)
    X, Y = subspace(rng, d), subspace(rng, d)
    tangent = logarithm(X, Y)
    np.testing.assert_allclose(tangent @ X.T, 0.0, atol=ROUNDING)
    angles = subspace_angles(X.T, Y.T)
    np.testing.assert_allclose(
        np.linalg.norm(tangent), np.linalg.norm(angles), rtol=ROUNDING
    )


@given(seed=seeds)
@settings(max_examples=50, deadline=None)
def test_two_lines_meet_halfway(seed):
    rng = np.random.default_rng(seed)
    a = subspace(rng, 1)
    b = subspace(rng, 1, near=a)
    b = b * np.sign(a @ b.T)
    halfway = (a + b) / np.linalg.norm(a + b)
    found = mean_subspace(np.array([a, -b]), np.array([[0.5, 0.5]]))[0]
    np.testing.assert_allclose(projector(found), projector(halfway), atol=1e-11)


@given(seed=seeds, d=st.integers(1, 3), share=st.floats(0.0, 1.0))
@settings(max_examples=50, deadline=None)
def test_the_mean_of_two_lies_on_the_geodesic_between(seed, d, share):
    rng = np.random.default_rng(seed)
    X = subspace(rng, d)
    Y = subspace(rng, d, near=X)
    found = mean_subspace(np.array([X, Y]), np.array([[1 - share, share]]))[0]
    expected = exponential(X, share * logarithm(X, Y))
    # Stops at steps of 1e-12; each round shrinks the error at least tenfold here.
    np.testing.assert_allclose(projector(found), projector(expected), atol=1e-11)


@given(seed=seeds, d=st.integers(1, 3))
@settings(max_examples=30, deadline=None)
def test_the_mean_does_not_see_signs_or_bases(seed, d):
    rng = np.random.default_rng(seed)
    middle = subspace(rng, d)
    spaces = np.array([subspace(rng, d, near=middle) for _ in range(6)])
    turned = np.array([subspace(rng, d, n=d) @ space for space in spaces])
    weights = rng.dirichlet(np.ones(6), 4)
    np.testing.assert_allclose(
        projector(mean_subspace(spaces, weights)),
        projector(mean_subspace(turned, weights)),
        atol=1e-11,
    )


@given(seed=seeds, d=st.integers(1, 3))
@settings(max_examples=30, deadline=None)
def test_at_the_mean_the_ways_to_the_subspaces_cancel(seed, d):
    rng = np.random.default_rng(seed)
    middle = subspace(rng, d)
    spaces = np.array([subspace(rng, d, near=middle) for _ in range(6)])
    weights = rng.dirichlet(np.ones(6))
    mean = mean_subspace(spaces, weights[None])[0]
    ways = logarithm(mean[None], spaces)
    np.testing.assert_allclose(np.tensordot(weights, ways, axes=1), 0.0, atol=1e-11)


@given(seed=seeds, d=st.integers(1, 3))
@settings(max_examples=30, deadline=None)
def test_the_mean_turns_with_the_subspaces(seed, d):
    rng = np.random.default_rng(seed)
    middle, turn = subspace(rng, d), subspace(rng, 7)
    spaces = np.array([subspace(rng, d, near=middle) for _ in range(5)])
    weights = rng.dirichlet(np.ones(5), 2)
    np.testing.assert_allclose(
        projector(mean_subspace(spaces @ turn, weights)),
        projector(mean_subspace(spaces, weights) @ turn),
        atol=1e-11,
    )


def test_opposite_signs_cancel_a_vector_mean_but_not_a_subspace_mean():
    a = np.eye(7)[:1]
    lines, even = np.array([a, -a]), np.array([[0.5, 0.5]])
    np.testing.assert_array_equal(np.tensordot(even, lines, axes=1), 0.0)
    np.testing.assert_allclose(
        projector(mean_subspace(lines, even)[0]), projector(a), atol=ROUNDING
    )
