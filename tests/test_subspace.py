"""Laws of null spaces, angles between subspaces and averaged null directions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from null_space_oracle import of_singular_values
from scipy.stats import ortho_group

from ikns.errors import InvalidInput, NotEnoughData
from ikns.numerics.subspace import (
    mean_null_direction,
    null_projector,
    null_space,
    principal_angles,
    principal_components,
)

EPS = np.finfo(float).eps
seeds = st.integers(0, 2**32 - 1)


def jacobian_of_rank(rng, k, n, rank):
    """A (k, n) matrix with `rank` singular values between 0.1 and 2, others zero."""
    return of_singular_values(rng, k, n, rng.uniform(0.1, 2.0, rank))


@given(seeds, st.integers(1, 7), st.integers(1, 9), st.data())
def test_null_space_is_orthonormal_complete_and_unseen_by_the_task(seed, k, n, data):
    rank = data.draw(st.integers(0, min(k, n)))
    J = jacobian_of_rank(np.random.default_rng(seed), k, n, rank)
    N = null_space(J)
    assert N.shape == (n - rank, n)
    # SVD is backward stable: errors of a few n * eps, singular values here are <= 2.
    assert np.abs(J @ N.T).max(initial=0) < 50 * EPS * n
    assert np.abs(N @ N.T - np.eye(n - rank)).max(initial=0) < 50 * EPS * n


@given(seeds, st.integers(0, 6))
def test_projector_agrees_with_the_basis_at_every_rank(seed, rank):
    J = jacobian_of_rank(np.random.default_rng(seed), 6, 7, rank)
    N = null_space(J)
    # Both come from singular vectors whose gap to the rest is 0.1 of a norm of 2, so
    # the subspace is known to about 7 * eps * 2 / 0.1.
    assert np.abs(null_projector(J) - N.T @ N).max() < 500 * EPS


def test_a_batch_of_projectors_mixes_ranks_and_marks_bad_postures():
    rng = np.random.default_rng(0)
    J = np.stack([jacobian_of_rank(rng, 6, 7, rank) for rank in (6, 5, 0, 6)])
    J[3, 2, 2] = np.nan
    P = null_projector(J.reshape(2, 2, 6, 7)).reshape(4, 7, 7)
    assert np.allclose(np.trace(P[:3], axis1=1, axis2=2), [1, 2, 7], atol=1e-13)
    assert np.isnan(P[3]).all()


def test_no_task_leaves_every_motion_free():
    assert np.array_equal(null_space(np.zeros((0, 3))), np.eye(3))


@given(seeds, st.floats(1e-3, 1e3))
def test_null_space_does_not_depend_on_the_unit_of_length(seed, unit):
    rng = np.random.default_rng(seed)
    J = jacobian_of_rank(rng, 6, 7, 6)
    scaled = J * np.repeat([unit, 1.0], 3)[:, None]
    # The null vector is known to n * eps * largest / smallest singular value, here
    # 7 * eps * (2 / 0.1) * 1e3 = 3e-11.
    assert principal_angles(null_space(J), null_space(scaled))[0] < 1e-10


@pytest.mark.parametrize("bad", [np.zeros(3), [[1.0, np.nan]], [[1.0, np.inf]]])
def test_null_space_refuses_what_is_not_a_finite_matrix(bad):
    with pytest.raises(InvalidInput, match="finite Jacobian"):
        null_space(bad)


def test_projector_refuses_a_vector():
    with pytest.raises(InvalidInput, match="Jacobians"):
        null_projector(np.zeros(3))


def planted(rng, n, angles):
    """Two bases, each mixed by a well-conditioned matrix, at the given angles."""
    p = len(angles)
    frame = ortho_group.rvs(n, random_state=rng)
    a = frame[:p]
    b = np.cos(angles)[:, None] * a + np.sin(angles)[:, None] * frame[p : 2 * p]
    mix = [ortho_group.rvs(p, random_state=rng) if p > 1 else np.eye(1) for _ in "ab"]
    return mix[0] @ a, mix[1] @ b


angle = st.one_of(
    st.floats(0, np.pi / 2),
    st.sampled_from([0.0, 1e-12, 1e-10, 1e-6, np.pi / 4, np.pi / 2]),
    st.sampled_from([1e-12, 1e-10, 1e-6]).map(lambda small: np.pi / 2 - small),
)


@given(seeds, st.lists(angle, min_size=1, max_size=3))
def test_planted_principal_angles_are_found_to_a_trillionth(seed, angles):
    angles = np.sort(angles)
    a, b = planted(np.random.default_rng(seed), 7, angles)
    # Sines and cosines are each right to a few n * eps = 1e-15 in absolute terms, and
    # atan2 does not amplify that.
    assert np.abs(principal_angles(a, b) - angles).max() < 1e-12
    assert np.abs(principal_angles(b, a) - angles).max() < 1e-12


def test_a_tiny_angle_next_to_a_right_angle_is_not_lost():
    a, b = planted(np.random.default_rng(1), 7, np.array([1e-10, 0.7, np.pi / 2]))
    assert principal_angles(a, b)[0] == pytest.approx(1e-10, abs=1e-14)


@given(seeds)
def test_angles_between_a_plane_and_a_line_do_not_depend_on_the_bases(seed):
    rng = np.random.default_rng(seed)
    frame = ortho_group.rvs(5, random_state=rng)
    plane = rng.uniform(0.5, 2.0, (2, 1)) * np.array([[1.0, 0.3], [-0.2, 1.0]])
    line = -3.0 * (np.cos(0.3) * frame[0] + np.sin(0.3) * frame[2])
    # The mixing matrix has a condition number below 10: 10 * 5 * eps.
    assert principal_angles(plane @ frame[:2], line[None])[0] == pytest.approx(
        0.3, abs=1e-13
    )


def test_angles_of_a_batch_are_the_angles_of_its_members():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(4, 2, 7)), rng.normal(size=(4, 3, 7))
    each = [principal_angles(x, y) for x, y in zip(a, b, strict=True)]
    assert np.allclose(principal_angles(a, b), each, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("a", "b", "sentence"),
    [
        ([[1.0, 0.0]], [[1.0, 0.0, 0.0]], "same space"),
        ([[1.0, 0.0], [2.0, 0.0]], [[1.0, 0.0]], "independent"),
        ([[np.nan, 0.0]], [[1.0, 0.0]], "finite rows"),
        (np.eye(3)[:, :2], [[1.0, 0.0]], "independent"),
    ],
)
def test_angles_refuse_what_is_not_two_subspaces(a, b, sentence):
    with pytest.raises(InvalidInput, match=sentence):
        principal_angles(a, b)


@given(seeds)
def test_one_posture_gives_its_own_null_direction(seed):
    J = jacobian_of_rank(np.random.default_rng(seed), 6, 7, 6)
    direction, concentration = mean_null_direction(J[None])
    assert principal_angles(direction, null_space(J))[0] < 1e-13
    # A projector on a line: one eigenvalue of 1, the others zero.
    assert np.abs(concentration - np.eye(7)[0]).max() < 1e-13


def test_symmetric_fan_of_lines_averages_to_its_middle():
    # Null lines at +-t from x: the mean projector is diag(cos^2, sin^2, 0).
    t = 0.4
    J = np.array([[[-np.sin(s), np.cos(s), 0], [0, 0, 1]] for s in (t, -t)])
    direction, concentration = mean_null_direction(J)
    assert np.allclose(direction, [[1, 0, 0]], rtol=0, atol=1e-15)
    assert np.allclose(
        concentration, [np.cos(t) ** 2, np.sin(t) ** 2, 0], rtol=0, atol=1e-15
    )


@given(seeds, st.integers(1, 3))
def test_directions_shared_by_all_postures_are_found_with_full_concentration(seed, d):
    rng = np.random.default_rng(seed)
    shared = ortho_group.rvs(7, random_state=rng)[:d]
    J = rng.normal(size=(5, 3, 7))
    J -= J @ shared.T @ shared
    directions, concentration = mean_null_direction(J, d)
    assert np.allclose(concentration[:d], 1.0, rtol=0, atol=1e-13)
    # 15 random rows leave the other eigenvalues well below 1 (gap above 1e-4).
    assert principal_angles(directions, shared).max() < 1e-10
    assert np.abs(directions @ directions.T - np.eye(d)).max() < 1e-14
    assert (directions[np.arange(d), np.abs(directions).argmax(axis=1)] > 0).all()


def test_postures_that_are_not_finite_are_left_out_of_the_average():
    J = np.stack([np.eye(3)[:2], np.full((2, 3), np.nan)])
    assert np.array_equal(mean_null_direction(J)[0], [[0.0, 0.0, 1.0]])
    with pytest.raises(NotEnoughData, match="finite Jacobian"):
        mean_null_direction(J[1:])


@pytest.mark.parametrize(("shape", "d"), [((2, 3), 1), ((1, 2, 3), 0), ((1, 2, 3), 4)])
def test_average_refuses_wrong_shapes_and_counts(shape, d):
    with pytest.raises(InvalidInput, match="expected"):
        mean_null_direction(np.zeros(shape), d)


@given(seeds)
def test_principal_components_are_those_of_a_planted_covariance(seed):
    rng = np.random.default_rng(seed)
    frame = ortho_group.rvs(4, random_state=rng)
    # Pairs of opposite vectors: exactly these variances about a mean of zero.
    rows = np.vstack([frame, -frame]) * np.tile([2.0, 1.5, 1.0, 0.5], 2)[:, None]
    mean = rng.normal(size=4)
    components, ratio = principal_components(rows + mean)
    assert np.allclose(ratio, np.array([4, 2.25, 1, 0.25]) / 7.5, rtol=0, atol=1e-14)
    # Variances differ by at least a tenth of the whole.
    assert np.abs(np.abs(components @ frame.T) - np.eye(4)).max() < 1e-13
    about_zero, _ = principal_components(rows + 100 * mean, centered=False)
    along = mean / np.linalg.norm(mean)
    assert abs(about_zero[0] @ along) > 0.99


def test_vectors_that_are_all_the_same_explain_nothing():
    components, ratio = principal_components(np.full((30, 3), 0.1))
    assert np.array_equal(ratio, np.zeros(3))
    assert np.array_equal(components, np.eye(3))
