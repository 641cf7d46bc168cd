"""Chance level: what random subspaces would show."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaincinv

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.numerics.subspace import principal_angles

#: Draws where there is no closed form.
_DRAWS = 4000
#: Quantiles of small angles, and of large shares.
_SMALL, _LARGE = np.array([0.05, 0.5]), np.array([0.5, 0.95])


def chance_angles(
    d: int,
    null_dim: int,
    n: int,
    *,
    seed: int | np.random.Generator = 0,
) -> Array:
    """Quantiles of the largest principal angle to a subspace drawn at random, rad.

    For a line the squared cosine is Beta(null_dim / 2, (n - null_dim) / 2) (Anderson
    2003, An introduction to multivariate statistical analysis, section 4.2); the same
    holds for any d against a line. Otherwise 4000 subspaces are drawn uniformly.

    Parameters
    ----------
    d, null_dim, n : int
        Directions learned, dimensions of the null space, joints.
    seed : int or numpy.random.Generator
        Without effect on the closed form.

    Returns
    -------
    (2,) array
        An angle below the first has one chance in twenty to be that small; the second
        is the median.

    Examples
    --------
    >>> np.degrees(chance_angles(1, 1, 7)).round(1)
    array([45. , 73.7])
    """
    if not (1 <= d <= n and 1 <= null_dim <= n):
        raise InvalidInput(
            f"expected 1 to {n} dimensions, found {d} directions and a null space of "
            f"{null_dim}."
        )
    if d + null_dim > n:
        # They share at least a line; the largest angle equals that between their
        # orthogonal complements.
        d, null_dim = n - null_dim, n - d
        if d == 0 or null_dim == 0:
            return np.zeros(2)
    few, many = sorted((d, null_dim))
    if few == 1:
        # The quantile of a beta distribution.
        cosine = betaincinv(many / 2, (n - many) / 2, 1 - _SMALL)
        return np.asarray(np.arccos(np.sqrt(cosine)))
    drawn = random_subspaces(few, n, _DRAWS, np.random.default_rng(seed))
    angles = principal_angles(drawn, np.eye(n)[:many])
    return np.quantile(angles.max(axis=-1), _SMALL)


def chance_inside(
    covariance: ArrayLike,
    null_dim: int,
    *,
    seed: int | np.random.Generator = 0,
) -> Array:
    """Median and 95th percentile of the variance share inside a random subspace, (2,).

    Its mean is ``null_dim / n`` for any covariance (n, n); its spread is larger the
    fewer directions hold the variance.
    """
    S = np.asarray(covariance, dtype=np.float64)
    variances = np.clip(np.linalg.eigvalsh(S), 0.0, None)
    if not variances.sum() > 0:
        return np.full(2, np.nan)
    drawn = random_subspaces(null_dim, len(S), _DRAWS, np.random.default_rng(seed))
    inside = np.sum(drawn**2, axis=1) @ variances / variances.sum()
    return np.quantile(inside, _LARGE)


def random_subspaces(d: int, n: int, draws: int, rng: np.random.Generator) -> Array:
    """Uniformly distributed subspaces as orthonormal rows, (draws, d, n)."""
    columns = np.linalg.qr(rng.normal(size=(draws, n, d)))[0]
    return np.swapaxes(columns, 1, 2)
