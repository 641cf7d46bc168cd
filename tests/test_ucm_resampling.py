"""Surrogates test what they say, intervals hold the truth as often as they say."""

import numpy as np
import pytest

from ikns.analysis.ucm import (
    VarianceSplit,
    confidence_interval,
    mean_interval,
    surrogate_test,
    variance_split,
)
from ikns.errors import InvalidInput, NotEnoughData

SUM = np.ones((1, 3))


def split_of(cov: np.ndarray, *, n: int, seed: int, times: int = 1) -> VarianceSplit:
    rng = np.random.default_rng(seed)
    return variance_split(
        rng.normal(size=(n, times, 3)) @ np.linalg.cholesky(cov).T, SUM
    )


INDEPENDENT = np.diag([4.0, 1.0, 0.25])
#: Joints that make up for each other in their sum.
TOGETHER = np.eye(3) - 0.3 * np.ones((3, 3))


def test_p_is_uniform_when_joints_vary_independently() -> None:
    p = [
        float(surrogate_test(split_of(INDEPENDENT, n=8, seed=s), n_surrogates=39).p[0])
        for s in range(250)
    ]
    # Exact permutation p values on the grid 1/40 ... 1, all equally likely: the largest
    # gap between both distributions stays below 1.63 / sqrt(250) with probability 0.99
    # (Kolmogorov), and the seeds are fixed.
    grid = np.arange(1, 41) / 40
    below = np.array([np.mean(np.array(p) <= g + 1e-12) for g in grid])
    assert abs(below - grid).max() < 1.63 / np.sqrt(250)


def test_joints_that_make_up_for_each_other_beat_their_surrogates() -> None:
    found = surrogate_test(split_of(TOGETHER, n=30, seed=1, times=4), n_surrogates=199)
    assert (found.p == 1 / 200).all()
    assert found.p_overall == 1 / 200
    assert (found.observed > found.mean).all()
    assert (found.observed > found.band()[1]).all()


def test_variance_where_the_task_looks_away_is_no_covariation() -> None:
    """Only the third joint, which the task hardly sees, varies much."""
    rng = np.random.default_rng(2)
    q = rng.normal(size=(40, 3)) * [0.1, 0.1, 3.0]
    split = variance_split(q, [[1.0, 1.0, 0.01]])
    found = surrogate_test(split, n_surrogates=199)
    assert split.delta_vz_corrected > 2
    assert found.p > 0.05
    assert abs(found.observed - found.mean) < 0.5


def test_joints_against_each_other_have_a_p_near_one() -> None:
    found = surrogate_test(split_of(np.eye(3) + 2, n=30, seed=3), n_surrogates=199)
    assert found.p > 0.99
    assert found.observed < found.mean


def test_surrogates_keep_each_joints_variance_and_lose_the_rest() -> None:
    split = split_of(TOGETHER, n=12, seed=4)
    drawn = surrogate_test(split, n_surrogates=2000).surrogates[:, 0]
    share = 1 / (1 + np.exp(-2 * drawn))  # of the squares that lie in the null space
    # Over all shuffles the products of two joints average to zero, so the mean share is
    # that of the variances alone: tr(P D) / tr(D), P having 2/3 on its diagonal.
    assert abs(share.mean() - 2 / 3) < 4 * share.std() / np.sqrt(2000)


def test_the_same_seed_gives_the_same_surrogates_and_another_gives_others() -> None:
    split = split_of(INDEPENDENT, n=10, seed=5)
    one, two, other = (
        surrogate_test(split, n_surrogates=20, seed=s).surrogates for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


def test_trials_with_a_gap_are_shuffled_among_those_that_are_known() -> None:
    rng = np.random.default_rng(6)
    q = rng.normal(size=(12, 2, 3))
    q[3, 1] = q[7, 1, 0] = np.nan
    split = variance_split(q, SUM)
    found = surrogate_test(split, n_surrogates=300)
    assert np.isfinite(found.surrogates).all()
    # Without the two trials the same joints are shuffled: the distributions agree. The
    # median of 300 is known to 1.25 sd / sqrt(300), and the seeds are fixed.
    alone = surrogate_test(
        variance_split(np.delete(q[:, 1], [3, 7], axis=0), SUM), n_surrogates=300
    ).surrogates
    error = 1.25 * alone.std() * np.sqrt(2 / 300)
    assert abs(np.median(found.surrogates[:, 1]) - np.median(alone)) < 3 * error


def test_a_time_without_a_split_has_no_p_and_does_not_spoil_the_others() -> None:
    rng = np.random.default_rng(7)
    J = rng.normal(size=(3, 1, 3))
    J[1] = 0
    found = surrogate_test(variance_split(rng.normal(size=(9, 3, 3)), J))
    assert np.isnan(found.p).tolist() == [False, True, False]
    assert np.isfinite(found.p_overall)


def test_shifted_series_keep_p_uniform_where_shuffled_samples_do_not() -> None:
    """Samples of one trial resemble their neighbors; joints are independent here."""
    rng = np.random.default_rng(8)
    rates = {"shift": 0, "trials": 0}
    runs = 100
    for _ in range(runs):
        # Ten sines of low frequency and random phase: stationary and smooth.
        phase = rng.uniform(0, 2 * np.pi, size=(10, 1, 3))
        angle = 2 * np.pi * np.arange(1, 11)[:, None, None] * np.arange(120)[:, None]
        q = (rng.normal(size=(10, 1, 3)) * np.sin(angle / 120 + phase)).sum(axis=0)
        split = variance_split(q, SUM)
        for by in rates:
            found = surrogate_test(split, n_surrogates=39, by=by)  # type: ignore[arg-type]
            rates[by] += found.p <= 0.05
    # Binomial: 0.05 of 100 is 5, and 11 or more have a chance of 1 %.
    assert rates["shift"] < 11
    assert rates["trials"] > 20


@pytest.mark.parametrize("method", ["jackknife", "bootstrap"])
def test_intervals_hold_a_known_truth_about_as_often_as_they_say(method: str) -> None:
    truth = np.log((TOGETHER.trace() - TOGETHER.sum() / 3) / (TOGETHER.sum() / 3)) / 2
    inside = 0
    runs = 200
    for seed in range(runs):
        split = split_of(TOGETHER, n=25, seed=seed)
        found = confidence_interval(split, method=method, n_resamples=200)
        inside += bool(found.low[0] <= truth <= found.high[0])
    # Nominal 95 %, documented down to 91 %; three binomial deviations below that.
    assert inside / runs > 0.91 - 3 * np.sqrt(0.95 * 0.05 / runs)


def test_the_jackknife_is_that_of_splits_that_leave_trials_out() -> None:
    rng = np.random.default_rng(9)
    q = rng.normal(size=(11, 4, 3))
    q[5, 2, 0] = np.nan
    split = variance_split(q, SUM)
    found = confidence_interval(split)
    again = np.array(
        [variance_split(np.delete(q, i, axis=0), SUM).delta_vz for i in range(11)]
    )
    # A task whose Jacobian is the same everywhere: nothing but the trial is left out.
    error = np.sqrt(10 / 11 * ((again - again.mean(axis=0)) ** 2).sum(axis=0))
    # Student's t with 10 degrees of freedom, from a table.
    np.testing.assert_allclose(found.high - found.estimate, 2.2281 * error, rtol=1e-4)
    np.testing.assert_allclose(found.estimate - found.low, 2.2281 * error, rtol=1e-4)


def test_the_interval_of_the_mean_is_narrower_over_independent_times() -> None:
    split = split_of(INDEPENDENT, n=30, seed=10, times=16)
    each, mean = confidence_interval(split), confidence_interval(split, overall=True)
    np.testing.assert_allclose(mean.estimate, split.delta_vz.mean(), rtol=1e-12)
    assert mean.high - mean.low < np.median(each.high - each.low) / 2


def test_blocks_widen_the_interval_of_samples_that_resemble_each_other() -> None:
    rng = np.random.default_rng(11)
    q = np.repeat(rng.normal(size=(40, 3)), 10, axis=0)
    q += 1e-6 * rng.normal(size=q.shape)
    split = variance_split(q, SUM)
    width = {}
    for block in (1, 10, None):
        found = confidence_interval(split, method="bootstrap", block=block)
        width[block] = found.high - found.low
    # 400 samples that are 40: wider by about sqrt(10), less for blocks that cut them.
    assert 2 < width[10] / width[1] < 4
    # G / g(0) is a third of ten samples, so three blocks of 130: Student's t and what
    # blocks lose make that 1.6 times as wide, and the length is estimated.
    assert 3 < width[None] / width[1] < 1.6 * np.sqrt(10) * 1.3


def test_the_mean_over_people_has_the_interval_of_student() -> None:
    found = mean_interval([[0.0, 1.0], [2.0, 1.0], [4.0, 4.0]])
    np.testing.assert_allclose(found.estimate, [2, 2])
    # sd 2 and sqrt(3) over sqrt(3), times t = 4.302653 with 2 degrees of freedom.
    half = 4.302653 * np.array([2, np.sqrt(3)]) / np.sqrt(3)
    np.testing.assert_allclose(found.high - found.estimate, half, rtol=1e-6)


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda s: surrogate_test(s, n_surrogates=0), InvalidInput),
        (lambda s: surrogate_test(s, by="joints"), InvalidInput),
        (lambda s: confidence_interval(s, method="guess"), InvalidInput),
        (lambda s: confidence_interval(s, confidence=1.0), InvalidInput),
        (
            lambda s: confidence_interval(s, method="bootstrap", block=9),
            InvalidInput,
        ),
        (lambda s: mean_interval([1.0]), NotEnoughData),
    ],
)
def test_what_cannot_be_answered_is_refused(call, error) -> None:
    with pytest.raises(error, match="expected .*found .*\\.$"):
        call(split_of(INDEPENDENT, n=8, seed=12))
