"""Random starts of k-means, against scikit-learn's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sklearn.cluster import kmeans_plusplus

from ikns.nullspace.clustering.plus_plus import plus_plus


def left(x: np.ndarray, centers: np.ndarray) -> float:
    """Sum of the squared distances from the nearest center."""
    return float(((x[:, None] - centers) ** 2).sum(axis=2).min(axis=1).sum())


def test_every_one_of_ten_held_places_gets_a_start() -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform(0, 0.5, size=(10, 3))
    x = np.repeat(places, 50, axis=0) + rng.normal(scale=1e-4, size=(500, 3))
    starts = plus_plus(x, 10, rng)
    nearest = ((starts[:, None] - places) ** 2).sum(axis=2).argmin(axis=1)
    assert sorted(nearest) == list(range(10))


def test_the_starts_are_as_good_as_scikit_learns() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(400, 3))
    ours = [left(x, plus_plus(x, 8, rng)) for _ in range(200)]
    theirs = [left(x, kmeans_plusplus(x, 8, random_state=k)[0]) for k in range(200)]
    # Two means of 200 draws differ by less than 4 of their standard errors, but once in
    # 16 000 times; the seed is fixed.
    error = np.hypot(np.std(ours), np.std(theirs)) / np.sqrt(200)
    assert abs(np.mean(ours) - np.mean(theirs)) < 4 * error
    random = [left(x, x[rng.choice(400, 8, replace=False)]) for _ in range(200)]
    assert np.mean(ours) < np.mean(random) - 4 * error


@given(
    arrays(np.float64, (12, 2), elements=st.integers(-3, 3).map(float)),
    st.integers(1, 12),
    st.integers(0, 2**32 - 1),
)
def test_starts_are_samples_and_differ_while_they_can(
    x: np.ndarray, n: int, seed: int
) -> None:
    starts = plus_plus(x, n, np.random.default_rng(seed))
    assert starts.shape == (n, 2)
    assert all((x == start).all(axis=1).any() for start in starts)
    different = len(np.unique(x, axis=0))
    assert len(np.unique(starts, axis=0)) == min(n, different)
    again = plus_plus(x, n, np.random.default_rng(seed))
    assert starts == pytest.approx(again, abs=0)
