"""The split holds its closed forms, its laws, and to a plain loop over trials.

Unless a test says otherwise the tolerance is 1e-12 relative: angles and Jacobians are
of size one, projectors are exact to 1e-15, and a handful of operations follow.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.analysis.ucm import chain_task, delta_vz, numerical_task, variance_split
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData

TIGHT = {"rtol": 1e-12, "atol": 1e-12}


def whitened(n_trials: int, n: int, seed: int) -> np.ndarray:
    """Trials whose sample covariance is the identity, exactly but for rounding."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n_trials, n))
    q -= q.mean(axis=0)
    left, _, right = np.linalg.svd(q, full_matrices=False)
    return np.sqrt(n_trials - 1) * left @ right


def planar_arm(q: np.ndarray) -> np.ndarray:
    """Jacobian of the tip of a planar arm with three links of 0.3, 0.3 and 0.2 m."""
    heading = np.cumsum(q, axis=-1)
    x, y = (np.array([0.3, 0.3, 0.2]) * f(heading) for f in (np.cos, np.sin))
    reach = [np.cumsum(part[..., ::-1], axis=-1)[..., ::-1] for part in (-y, x)]
    return np.stack(reach, axis=-2)


# --- closed forms -------------------------------------------------------------------


@pytest.mark.parametrize(("n", "k"), [(2, 1), (3, 1), (3, 2), (7, 3), (7, 6), (9, 6)])
def test_equal_variance_in_all_directions_has_no_structure(n: int, k: int) -> None:
    J = np.random.default_rng(n).normal(size=(k, n))
    split = variance_split(whitened(20, n, seed=k), J)
    np.testing.assert_allclose(split.v_ucm, 1, **TIGHT)
    np.testing.assert_allclose(split.v_ort, 1, **TIGHT)
    np.testing.assert_allclose(split.v_tot, 1, **TIGHT)
    np.testing.assert_allclose(split.delta_v, 0, **TIGHT)
    np.testing.assert_allclose(split.delta_vz, np.log((n - k) / k) / 2, **TIGHT)
    np.testing.assert_allclose(split.delta_vz_corrected, 0, **TIGHT)


@given(st.floats(0.1, 10), st.floats(0.1, 10), st.floats(0.1, 10))
def test_a_sum_of_two_joints_splits_a_known_covariance(a: float, b: float, c: float):
    """Along (1, -1, 0) and the third joint against along (1, 1, 0), by hand."""
    axes = np.array([[1, 1, 0], [1, -1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)
    q = whitened(12, 3, seed=1) * np.sqrt([a, b, c]) @ axes
    split = variance_split(q, [[2.0, 2.0, 0.0]])
    ucm, ort = (b + c) / 2, a
    np.testing.assert_allclose(split.v_ucm, ucm, **TIGHT)
    np.testing.assert_allclose(split.v_ort, ort, **TIGHT)
    np.testing.assert_allclose(split.delta_v, 3 * (ucm - ort) / (a + b + c), **TIGHT)
    np.testing.assert_allclose(split.delta_vz, np.log((b + c) / a) / 2, **TIGHT)


def test_a_planar_arm_splits_along_its_known_null_direction() -> None:
    mean = np.array([0.4, 0.9, 0.7])
    # The cross product of both rows is what neither sees.
    null = np.cross(*planar_arm(mean))
    null /= np.linalg.norm(null)
    rest = np.linalg.svd(null[None])[2][1:]
    q = mean + whitened(10, 3, seed=2) * [0.2, 0.05, 0.1] @ np.vstack([null, rest])
    split = variance_split(q, planar_arm)
    np.testing.assert_allclose(split.v_ucm, 0.2**2, **TIGHT)
    np.testing.assert_allclose(split.v_ort, (0.05**2 + 0.1**2) / 2, **TIGHT)


@pytest.mark.parametrize(("n", "k"), [(3, 1), (3, 2), (7, 3), (7, 6)])
def test_all_variance_on_one_side_is_the_bound(n: int, k: int) -> None:
    rng = np.random.default_rng(k)
    J = rng.normal(size=(k, n))
    rows = np.linalg.svd(J)[2]
    for part, bound, z in (
        (rows[k:], n / (n - k), np.inf),
        (rows[:k], -n / k, -np.inf),
    ):
        q = rng.normal(size=(n + 5, len(part))) @ part
        split = variance_split(q, J)
        np.testing.assert_allclose(split.delta_v, bound, **TIGHT)
        assert split.delta_vz == split.delta_vz_corrected == z
        assert min(split.v_ucm, split.v_ort) == 0


def test_the_transform_is_the_fisher_like_one_between_the_bounds() -> None:
    n, k, value = 7, 3, np.linspace(-7 / 3, 7 / 4, 9)
    with np.errstate(divide="ignore"):
        expected = np.log((n / k + value) / (n / (n - k) - value)) / 2
    found = delta_vz(value, n_joints=n, n_task=k)
    # At the bounds both are infinite; near them 1e-16 of cancellation in 0.1.
    np.testing.assert_allclose(found, expected, rtol=1e-12)


# --- laws ---------------------------------------------------------------------------

SIZES = st.tuples(st.integers(2, 9), st.integers(0, 2**32 - 1)).flatmap(
    lambda s: st.tuples(st.just(s[0]), st.integers(1, s[0] - 1), st.just(s[1]))
)


def trials(n: int, seed: int) -> tuple[np.random.Generator, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng, rng.normal(size=(n + 4, 3, n)) @ rng.normal(size=(n, n))


def by_svd_and_loop(q: np.ndarray, J: np.ndarray) -> tuple[float, float]:
    """Both variances of (N, n) trials from the full SVD, one trial at a time."""
    k, n = J.shape
    right = np.linalg.svd(J)[2]
    mean = sum(q) / len(q)
    ucm = ort = 0.0
    for posture in q:
        for i, axis in enumerate(right):
            square = float(axis @ (posture - mean)) ** 2
            ort, ucm = (ort + square, ucm) if i < k else (ort, ucm + square)
    return ucm / ((n - k) * (len(q) - 1)), ort / (k * (len(q) - 1))


@given(SIZES)
def test_the_split_agrees_with_a_loop_over_trials_and_axes(
    size: tuple[int, int, int],
) -> None:
    n, k, seed = size
    rng, q = trials(n, seed)
    J = rng.normal(size=(3, k, n))
    split = variance_split(q, J)
    loop = np.array([by_svd_and_loop(q[:, t], J[t]) for t in range(3)])
    # The null space of a random Jacobian is known to 1e-16 times its condition, which
    # may well be 1e4; variances are compared with the whole.
    for found, expected in zip((split.v_ucm, split.v_ort), loop.T, strict=True):
        assert np.all(abs(found - expected) <= 1e-9 * split.v_tot)


@given(SIZES)
def test_both_parts_add_up_to_the_whole_variance(size: tuple[int, int, int]) -> None:
    n, k, seed = size
    rng, q = trials(n, seed)
    split = variance_split(q, rng.normal(size=(3, k, n)))
    whole = q.var(axis=0, ddof=1).sum(axis=-1)
    np.testing.assert_allclose((n - k) * split.v_ucm + k * split.v_ort, whole, **TIGHT)
    np.testing.assert_allclose(n * split.v_tot, whole, **TIGHT)
    z = delta_vz(split.delta_v, n_joints=n, n_task=k)
    # dV is rounded at 1e-16 of its range, near a bound its log with 1e-16 / distance.
    edge = np.minimum(split.delta_v + n / k, n / (n - k) - split.delta_v)
    assert np.all(abs(z - split.delta_vz) <= 1e-13 * n / edge)


@given(SIZES)
def test_rotated_joints_and_other_task_coordinates_change_nothing(
    size: tuple[int, int, int],
) -> None:
    n, k, seed = size
    rng, q = trials(n, seed)
    J = rng.normal(size=(3, k, n))
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    # Well conditioned, so that 1e-9 holds as it does above.
    mixing = np.linalg.qr(rng.normal(size=(k, k)))[0] * rng.uniform(0.1, 10, size=k)
    one, two = variance_split(q, J), variance_split(q @ turn, mixing @ J @ turn)
    assert np.all(abs(one.v_ucm - two.v_ucm) <= 1e-9 * one.v_tot)
    assert np.all(abs(one.v_ort - two.v_ort) <= 1e-9 * one.v_tot)


def test_order_of_trials_a_common_offset_and_a_unit_do_not_matter() -> None:
    rng, q = trials(5, 3)
    J = rng.normal(size=(2, 5))
    one = variance_split(q, J)
    two = variance_split(np.degrees(rng.permutation(q) + rng.normal(size=5)), 1000 * J)
    np.testing.assert_allclose(two.v_ucm, np.degrees(np.degrees(one.v_ucm)), **TIGHT)
    np.testing.assert_allclose(two.delta_vz, one.delta_vz, **TIGHT)


# --- what a Jacobian may be -----------------------------------------------------------


def test_a_skeleton_an_array_and_a_function_give_the_same_split() -> None:
    skeleton = Skeleton.load()
    body = np.full(18, 0.4)
    q = 0.5 + 0.1 * np.random.default_rng(5).normal(size=(12, 4, 7))
    task = chain_task(skeleton, "right_arm", body)

    def hand(postures: np.ndarray) -> np.ndarray:
        angles = np.tile(body, (*postures.shape[:-1], 1))
        columns = skeleton.columns(tuple(task_joints)) - 6
        angles[..., columns] = postures
        return skeleton.hands_in_thorax(angles)[0][..., 0, :]

    from ikns.body.chains import chain_joints

    task_joints = chain_joints("right_arm")
    mean = q.mean(axis=0)
    np.testing.assert_allclose(numerical_task(hand)(mean), task(mean), atol=1e-9)
    one = variance_split(q, task)
    np.testing.assert_array_equal(variance_split(q, task(mean)).v_ucm, one.v_ucm)
    # A Jacobian off by 1e-10 turns the null space by about 1e-9.
    other = variance_split(q, numerical_task(hand))
    np.testing.assert_allclose(other.v_ucm, one.v_ucm, rtol=1e-7)
    # Averaged over the visited postures it is another, given as it is or as a function.
    visited = variance_split(q, task, at="visited")
    np.testing.assert_allclose(variance_split(q, task(q)).v_ucm, visited.v_ucm, **TIGHT)
    assert abs(visited.v_ucm / one.v_ucm - 1).max() > 1e-5


def test_differences_of_a_function_err_as_little_as_stated() -> None:
    q = np.random.default_rng(6).uniform(-2, 2, size=(100, 3))
    found = numerical_task(lambda p: np.stack([np.sin(p).sum(-1), p.prod(-1)], -1))(q)
    exact = np.stack([np.cos(q), q.prod(-1, keepdims=True) / q], axis=-2)
    # Truncation 6e-12, rounding of values up to 8: 8 * 1.1e-16 / 6e-6 = 1.5e-10.
    np.testing.assert_allclose(found, exact, atol=2e-10)


# --- missing and degenerate samples ---------------------------------------------------


def test_a_missing_sample_leaves_its_trial_out_at_that_time_only() -> None:
    rng, q = trials(4, 7)
    J = rng.normal(size=(3, 2, 4))
    whole = variance_split(q, J)
    q[2, 1, 3] = np.nan
    split = variance_split(q, J)
    assert split.trials.tolist() == [8, 7, 8]
    np.testing.assert_array_equal(split.v_ucm[[0, 2]], whole.v_ucm[[0, 2]])
    alone = variance_split(np.delete(q[:, 1], 2, axis=0), J[1])
    np.testing.assert_allclose(split.v_ucm[1], alone.v_ucm, **TIGHT)
    np.testing.assert_allclose(split.v_ort[1], alone.v_ort, **TIGHT)


def test_lost_rank_at_one_time_is_a_gap_there() -> None:
    rng, q = trials(4, 8)
    J = rng.normal(size=(3, 2, 4))
    J[1, 1] = 2 * J[1, 0]
    split = variance_split(q, J)
    assert split.rank.tolist() == [2, 1, 2]
    assert split.rank_lost.tolist() == [False, True, False]
    assert np.isnan(split.delta_vz).tolist() == [False, True, False]
    J[1] = np.nan
    assert variance_split(q, J).rank.tolist() == [2, -1, 2]


def test_too_few_known_trials_at_one_time_are_a_gap_there() -> None:
    rng, q = trials(4, 9)
    q[:4, 2] = np.nan
    split = variance_split(q, rng.normal(size=(2, 4)))
    assert np.isnan(split.v_ucm).tolist() == [False, False, True]
    fewer = variance_split(q, rng.normal(size=(2, 4)), min_trials=2)
    assert np.isfinite(fewer.v_ucm).all()


# --- refused ------------------------------------------------------------------------

Q = np.random.default_rng(10).normal(size=(9, 5, 4))
STILL = np.concatenate([Q[..., :3], np.ones((9, 5, 1))], axis=-1)
FLAT = np.ones((2, 4))


@pytest.mark.parametrize(
    ("q", "J", "options", "error", "says"),
    [
        (Q[:4], FLAT[:1], {}, NotEnoughData, "at least 5 trials .* 4 joints, found 4"),
        (Q[:1], FLAT[:1], {"min_trials": 2}, NotEnoughData, "at least 2 .* found 1"),
        (Q, FLAT[:1], {"min_trials": 1}, InvalidInput, "min_trials of at least 2"),
        (Q[:0], FLAT[:1], {}, NotEnoughData, r"empty selection \(0, 5, 4\)"),
        (Q[:, :0], FLAT[:1], {}, NotEnoughData, r"empty selection \(9, 0, 4\)"),
        (Q[0, 0], FLAT[:1], {}, InvalidInput, r"found an array \(4,\)"),
        (Q[..., :1], FLAT[:1, :1], {}, InvalidInput, "at least 2 joints"),
        (Q * np.inf, FLAT[:1], {}, InvalidInput, "infinity"),
        (Q * np.nan, FLAT[:1], {}, NotEnoughData, "found 0"),
        (STILL, FLAT[:1], {}, NotEnoughData, "joint 3 is constant"),
        (STILL, FLAT[:1], {"joint_names": "abcd"}, NotEnoughData, "joint d is const"),
        (Q, FLAT[:1], {"joint_names": "abc"}, InvalidInput, "4 joint names, found 3"),
        (Q, FLAT, {}, InvalidInput, "rank 2, .* found rank 1 at most over 5 mean"),
        (Q, FLAT * np.nan, {}, InvalidInput, "found none finite"),
        (Q, np.eye(4), {}, InvalidInput, "fewer variables than the 4 joints, found 4"),
        (Q, np.ones((1, 5)), {}, InvalidInput, r"\(5, k, 4\) or \(9, 5, k, 4\)"),
        (Q, np.ones((3, 1, 4)), {}, InvalidInput, "expected Jacobians"),
        (Q, np.ones((0, 4)), {}, InvalidInput, "expected Jacobians"),
        (Q, lambda q: q, {}, InvalidInput, "expected Jacobians"),
        (Q, FLAT[:1], {"at": "median"}, InvalidInput, "'mean' or 'visited'"),
    ],
)
def test_input_without_an_answer_is_refused_in_one_sentence(
    q, J, options, error, says
) -> None:
    with pytest.raises(error, match=says) as caught:
        variance_split(q, J, **options)
    assert str(caught.value).endswith(".")


def test_values_beyond_the_bounds_have_no_transform() -> None:
    with pytest.raises(InvalidInput, match="from -1.5 to 3"):
        delta_vz([0.0, 3.1], n_joints=3, n_task=2)
    with pytest.raises(InvalidInput, match="found 3 and 3"):
        delta_vz(0.0, n_joints=3, n_task=3)


def test_a_task_that_does_not_fit_its_skeleton_or_its_function_is_refused() -> None:
    with pytest.raises(InvalidInput, match="18"):
        chain_task(Skeleton.load(), "right_arm", np.zeros(7))
    with pytest.raises(InvalidInput, match="positive step"):
        numerical_task(np.sin, step=0)
    with pytest.raises(InvalidInput, match="expected a function"):
        numerical_task(lambda q: q.sum(axis=-1))(np.zeros((5, 3)))
