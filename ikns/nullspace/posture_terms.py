"""Terms of the natural posture, and the ridge that weighs them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array

#: Middle of the work space, m, and the unit of length, m: the quadratic terms are then
#: of order 1 wherever a hand goes (ISB thorax, right arm).
MIDDLE, UNIT = np.array([0.25, -0.15, 0.20]), 0.2
#: What of the taught places counts as taught.
_TAUGHT = 0.99
#: Columns of a wrist, and of a wrist with the direction of the hand; and their terms.
WRIST, HAND = 3, 6
TERMS = {WRIST: 10, HAND: 13}


def quadratic_terms(wrist_in_thorax: ArrayLike) -> Array:
    """Terms 1, x_i, x_i^2 and x_i x_j of positions, (..., 10) for three dimensions.

    Positions (..., 3) in m count from (0.25, -0.15, 0.20) m, in units of 0.2 m; of
    other dimensions they count from zero.
    """
    w = np.asarray(wrist_in_thorax, dtype=np.float64)
    x = (w - MIDDLE if w.shape[-1] == 3 else w) / UNIT
    i, j = np.triu_indices(w.shape[-1], 1)
    return np.concatenate([np.ones((*x.shape[:-1], 1)), x, x**2, x[..., i] * x[..., j]],
                          axis=-1)  # fmt: skip


def natural_terms(X: ArrayLike) -> Array:
    """Terms of wrist centers (..., 3), (..., 10), or with the hand (..., 6), (..., 13).

    Those of :func:`quadratic_terms`, then the hand's direction as it is: a unit vector
    from wrist to knuckle.
    """
    rows = np.asarray(X, dtype=np.float64)
    terms = quadratic_terms(wrist_of(rows))
    if rows.shape[-1] != HAND:
        return terms
    return np.concatenate([terms, rows[..., WRIST:]], axis=-1)


def wrist_of(X: Array) -> Array:
    """Wrist centers (..., 3) of rows that may have the hand's direction too."""
    return X[..., :WRIST] if X.shape[-1] == HAND else X


def ridge(phi: Array, swivel: Array, penalty: float) -> Array:
    """Return coefficients (K,) of terms (N, K), drawn to zero but for the constant."""
    n = len(phi)
    normal = phi.T @ phi / n + _penalties(phi.shape[1], penalty)
    return np.asarray(np.linalg.solve(normal, phi.T @ swivel / n))


def leverage_of(phi: Array, penalty: float) -> tuple[Array, float]:
    """Matrix of the leverage of terms (N, K), (K, K), and its 99th percentile."""
    penalties = _penalties(phi.shape[1], penalty)
    matrix = np.asarray(np.linalg.inv(phi.T @ phi / len(phi) + penalties), np.float64)
    levels = np.einsum("ni,ij,nj->n", phi, matrix, phi)
    return matrix, float(np.quantile(levels, _TAUGHT))


def _penalties(k: int, penalty: float) -> Array:
    """Return the penalties (K, K) of terms; the first is a constant and has none."""
    return np.diag(np.r_[0.0, np.full(k - 1, float(penalty))])
