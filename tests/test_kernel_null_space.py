"""Compiled null spaces and principal angles against exact and independent ones."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from null_space_oracle import (
    MIXED,
    exact_projector,
    mixed_pair,
    of_singular_values,
    svd_angles,
    svd_projector,
)

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.numerics.subspace import (
    null_projector,
    null_space,
    null_spaces,
    principal_angles,
)

EPS = np.finfo(float).eps
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize(("k", "n"), [(6, 7), (3, 7), (6, 9), (12, 14), (1, 3), (4, 4)])
def test_projectors_are_exact_in_any_mixture_of_units(k, n):
    rng = np.random.default_rng(k)
    J = rng.normal(size=(8, k, n)) * 10 ** rng.uniform(-3, 3, (8, k, 1))
    exact = np.stack([exact_projector(j) for j in J])
    # Reflections of rows know nothing of the rows' units: what counts is how near the
    # rows, brought to one length, are to being dependent.
    even = J / np.linalg.norm(J, axis=2, keepdims=True)
    s = np.linalg.svd(even, compute_uv=False)
    bound = 10 * n * EPS * s[:, 0] / s[:, -1]
    error = np.abs(null_projector(J) - exact).max(axis=(1, 2))
    assert (error < bound).all()
    # LAPACK's singular vectors do feel the units, so they are no better.
    assert np.median(error) <= np.median(
        np.abs(svd_projector(J)[0] - exact).max((1, 2))
    )


@settings(max_examples=200)
@given(
    seeds,
    st.integers(1, 14),
    st.integers(1, 14),
    st.sampled_from([1e-305, 1e-200, 1e-3, 1.0, 1e3, 1e200, 1e300]),
    st.data(),
)
def test_bases_agree_with_singular_vectors_at_every_shape_rank_and_scale(
    seed, k, n, scale, data
):
    rng = np.random.default_rng(seed)
    ranks = [data.draw(st.integers(0, min(k, n))) for _ in range(3)]
    J = np.stack([of_singular_values(rng, k, n, rng.uniform(0.1, 2, r)) for r in ranks])
    basis, rank = null_spaces(J * scale)
    assert rank.tolist() == ranks
    assert basis.shape == (3, n - min(ranks), n)
    for rows, r in zip(basis, ranks, strict=True):
        # Orthonormal to rounding, in the upper rows; the lower ones are zero.
        square = np.diag(np.arange(len(rows)) < n - r)
        assert np.abs(rows @ rows.T - square).max(initial=0) < 10 * n * EPS
    # Both feel a gap of 0.1 in a norm of 2.
    gap = np.abs(np.swapaxes(basis, 1, 2) @ basis - svd_projector(J)[0])
    assert gap.max() < 20 * 10 * n * EPS


@settings(max_examples=100)
@given(seeds, st.floats(-13, -5), st.integers(1, 3))
def test_a_singular_value_near_the_tolerance_is_judged_as_the_svd_judges_it(
    seed, power, small
):
    rng = np.random.default_rng(seed)
    values = np.append(rng.uniform(0.1, 2, 6 - small), np.full(small, 10.0**power))
    J = of_singular_values(rng, 6, 7, values)
    projector, rank = svd_projector(J)
    s = np.linalg.svd(J, compute_uv=False)
    if np.abs(s / s[0] / 1e-9 - 1).min() < 1e-5:
        return  # rounding (1e-16) decides at 1e-9
    basis, ours = null_spaces(J)
    assert ours == rank
    # The smallest value that counts is what keeps the spaces apart.
    apart = s[rank - 1] / s[0] if rank == 6 else 0.05
    assert np.abs(basis.T @ basis - projector).max() < 100 * 7 * EPS / apart


@pytest.mark.parametrize("rtol", [0.5, 1e-3, 1e-12])
def test_tolerance_is_relative_to_the_largest_singular_value(rtol):
    J = np.diag([4.0, 4.0 * rtol * 1.001, 4.0 * rtol * 0.999])
    assert null_spaces(J, rtol=rtol)[1] == 2
    assert null_space(J, rtol=rtol).shape == (1, 3)


def test_an_almost_straight_elbow_loses_rank_as_the_svd_says():
    skeleton = Skeleton.load()
    q = np.full((9, 18), 0.3)
    elbow = skeleton.joint_names.index("right_elbow_flexion")
    q[:, elbow] = [0.3, 1e-3, 1e-6, 1e-7, 1e-8, 1e-9, -1e-9, 0.0, -1e-3]
    J = skeleton.chain_jacobian(q, "right_arm")
    basis, rank = skeleton.null_spaces(q, "right_arm")
    projector, expected = svd_projector(J)
    assert rank.tolist() == expected.tolist() == [6, 6, 6, 6, 5, 5, 5, 5, 6]
    s = np.linalg.svd(J, compute_uv=False)
    for i in range(9):
        apart = s[i, rank[i] - 1] / s[i, 0]
        gap = np.abs(basis[i].T @ basis[i] - projector[i]).max()
        assert gap < 100 * 7 * EPS / apart
    # A pose of full rank has one row, and zeros where the straight arm has a second.
    assert basis.shape == (9, 2, 7)
    assert not basis[0, 1].any()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_stays_with_its_posture(bad):
    J = np.random.default_rng(0).normal(size=(4, 6, 7))
    J[1, 2, 3] = bad
    basis, rank = null_spaces(J)
    assert rank.tolist() == [6, -1, 6, 6]
    assert np.isnan(basis[1]).all()
    np.testing.assert_array_equal(basis[[0, 2, 3]], null_spaces(J[[0, 2, 3]])[0])
    assert np.isnan(null_projector(J)[1]).all()


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ((0, 6, 7), (0, 1, 7)),
        ((2, 0, 3), (2, 3, 3)),
        ((2, 3, 0), (2, 0, 0)),
        ((5, 4), (4, 4)),
        ((2, 3, 9, 4), (2, 3, 4, 4)),
    ],
)
def test_a_task_that_sees_nothing_leaves_the_whole_space(shape, expected):
    basis, rank = null_spaces(np.zeros(shape))
    assert basis.shape == expected
    assert rank.shape == shape[:-2]
    assert not rank.any()
    assert np.array_equal(
        basis, np.broadcast_to(np.eye(shape[-1])[: expected[-2]], expected)
    )


def test_a_task_that_sees_all_leaves_nothing():
    rng = np.random.default_rng(0)
    for k in (7, 9):
        basis, rank = null_spaces(rng.normal(size=(4, k, 7)))
        assert basis.shape == (4, 0, 7)
        assert (rank == 7).all()
        assert not null_projector(rng.normal(size=(4, k, 7))).any()


def test_arrays_that_are_frozen_strided_or_of_integers_are_taken_as_they_are():
    J = np.random.default_rng(0).integers(-9, 9, (5, 6, 7))
    basis, _ = null_spaces(J.astype(float))
    frozen = J.astype(float)
    frozen.flags.writeable = False
    for other in (J, frozen, np.asfortranarray(J), np.repeat(J, 2, axis=0)[::2]):
        np.testing.assert_array_equal(null_spaces(other)[0], basis)


def test_threads_do_not_share_memory():
    rng = np.random.default_rng(0)
    batches = rng.normal(size=(16, 500, 6, 7))
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda J: null_spaces(J)[0], batches))
    np.testing.assert_array_equal(together, [null_spaces(J)[0] for J in batches])


@pytest.mark.parametrize("seed", range(20))
def test_all_sizes_of_angle_are_found_in_one_pair_of_subspaces(seed):
    a, b = mixed_pair(np.random.default_rng(seed))
    found = principal_angles(a, b)
    # Turning the frame rounds each row to 12 * eps / 2, mixing with a condition number
    # of at most 10 makes that 1e-14.
    assert np.abs(found - MIXED).max() < 2e-14
    assert np.abs(principal_angles(b, a) - MIXED).max() < 2e-14


def test_angles_between_exact_rows_are_exact_to_rounding():
    eye = np.eye(12)
    tangent = np.array([1e-14, 1e-10, 1e-5, 1.0])
    b = eye[:6].copy()
    b[:4] += tangent[:, None] * eye[6:10]
    b[4:] = [1e-10 * eye[4] + eye[10], eye[11]]
    truth = np.append(np.arctan(tangent), [np.arctan2(1, 1e-10), np.pi / 2])
    # Sines and cosines are entries of orthonormal rows, each rounded twice or so.
    assert np.abs(principal_angles(eye[:6], b) - truth).max() < 2 * EPS


@given(seeds, st.integers(1, 7), st.integers(1, 7), st.integers(0, 5))
def test_angles_agree_with_those_by_singular_values(seed, p, r, more):
    rng = np.random.default_rng(seed)
    n = max(p, r) + more
    p, r = max(p, r), min(p, r)
    a, b = rng.normal(size=(3, p, n)), rng.normal(size=(3, r, n))
    # Orthonormal rows of random ones are exact to their condition number.
    worst = max(np.linalg.cond(x) for x in (*a, *b))
    gap = np.abs(principal_angles(a, b) - svd_angles(a, b)).max()
    assert gap < 20 * n * EPS * worst
    # In a space too small for both they meet.
    meet = principal_angles(a, b)[:, : max(p + r - n, 0)]
    assert meet.max(initial=0) < 20 * n * EPS * worst


def test_angles_do_not_depend_on_the_lengths_of_the_rows():
    rng = np.random.default_rng(0)
    a, b = mixed_pair(rng)
    # Within the 1e-12 that tell independent rows from dependent ones.
    lengths = 10 ** rng.uniform(-5, 5, (6, 1))
    assert np.abs(principal_angles(lengths * a, b) - MIXED).max() < 2e-14
    assert np.abs(principal_angles(1e200 * a, 1e-200 * b) - MIXED).max() < 2e-14


def test_one_subspace_is_compared_with_many():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 7)), rng.normal(size=(3, 1, 4, 7))
    angles = principal_angles(a, b)
    assert angles.shape == (3, 1, 2)
    np.testing.assert_array_equal(angles[2, 0], principal_angles(a, b[2, 0]))
    assert principal_angles(np.empty((0, 2, 7)), np.ones((1, 7))).shape == (0, 1)


def test_dependent_rows_anywhere_in_a_batch_are_refused():
    a = np.random.default_rng(0).normal(size=(3, 2, 5))
    a[2, 1] = 2 * a[2, 0]
    with pytest.raises(InvalidInput, match="independent"):
        principal_angles(a, np.eye(5)[:1])
