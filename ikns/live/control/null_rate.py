"""Rate of c due to the null-space part of a joint velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput

Array = NDArray[np.float64]


def null_rate(
    directions: ArrayLike,
    width: ArrayLike,
    basis: ArrayLike,
    v: ArrayLike,
    *,
    metric: ArrayLike | None = None,
) -> Array:
    """Rate of c due to the null-space part of a joint velocity.

    ``Z P v / (M - m)`` with the projector ``P = N' (N W N')^-1 N W``. The rows of N
    span the null space; their signs and order do not matter, so a decomposition whose
    basis flips causes no jump. A null motion passes unchanged (``P n = n``), so while
    the hand is held this is the rate of the position mode's c, even along a curved
    self-motion.

    W decides which task motion counts as free of null motion: with the identity it is
    the shortest joint velocity that does the task, with a mass matrix the one of least
    kinetic energy, with the inverse covariance of joint velocities the expected one
    (Khatib 1987, IEEE J Robot Autom 3:43, for the weighted inverse).

    Parameters
    ----------
    directions : (..., d, n) array
        Z at the hand's position.
    width : (..., d) array
        M - m there, rad.
    basis : (..., r, n) array
        Rows N that span the null space; rows of zeros are skipped.
    v : (..., n) array
        Joint velocity, rad/s.
    metric : (n, n) array, optional
        W, symmetric and positive definite; by default the identity, for which the rows
        of N must be orthonormal.

    Returns
    -------
    (..., d) array
        1/s.

    Examples
    --------
    >>> null_rate([[0.0, 1.0]], [0.5], [[0.0, 1.0]], [3.0, 2.0])
    array([4.])
    """
    Z, N = np.asarray(directions, dtype=float), np.asarray(basis, dtype=float)
    across = np.swapaxes(N, -2, -1)
    if metric is None:
        amount = N @ np.asarray(v, dtype=float)[..., None]
    else:
        weighted = N @ np.asarray(metric, dtype=float)
        gram = weighted @ across
        # A row of zeros is skipped: its equation becomes 1 * 0 = 0.
        empty = np.einsum("...ii->...i", gram) == 0
        gram = gram + empty[..., None] * np.eye(gram.shape[-1])
        amount = np.linalg.solve(gram, weighted @ np.asarray(v, dtype=float)[..., None])
    return np.asarray((Z @ across @ amount)[..., 0] / np.asarray(width, dtype=float))


def garrote(values: Array, least: Array | float) -> Array:
    """Zero up to `least`, above it reduced by ``least**2 / value``.

    Continuous, and large values pass almost unchanged (non-negative garrote: Breiman
    1995, Technometrics 37:373; as a threshold Gao 1998, J Comput Graph Stat 7:469).

    Examples
    --------
    >>> import numpy as np
    >>> garrote(np.array([-4.0, 0.5, 1.0, 2.0]), 1.0).tolist()
    [-3.75, 0.0, 0.0, 1.5]
    """
    beyond = np.abs(values) > least
    share = np.divide(least, values, out=np.ones_like(values), where=beyond)
    return np.asarray(values * (1 - share**2))


def checked_metric(metric: ArrayLike | None, n: int) -> Array | None:
    """Return a metric of n joints as a matrix, or raise an error."""
    if metric is None:
        return None
    W = np.array(metric, dtype=np.float64)
    W = np.diag(W) if W.ndim == 1 else W
    if (
        W.shape != (n, n)
        or not np.isfinite(W).all()
        or not np.allclose(W, W.T)
        or np.linalg.eigvalsh(W)[0] <= 0
    ):
        raise InvalidInput(
            f"expected a symmetric positive metric of {n} joints, found {W.shape}."
        )
    return W
