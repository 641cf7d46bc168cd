"""Linear subspaces of joint space: null spaces, angles between them, their average.

A subspace is an array of rows that span it. A Jacobian maps joint rates (rad/s) to task
rates; its rows may mix meters and radians. The null space itself does not depend on how
rows are scaled (``J n = 0`` row by row), but singular values do, and with them the
decision which of them are zero. The default ``rtol`` of 1e-9 stands far below the ratio
that a change of unit or an almost straight arm makes (1e-3 each) and far above
rounding (1e-16), so the decision is the same in meters and in millimeters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput, NotEnoughData

__all__ = [
    "largest_entry_positive",
    "mean_null_direction",
    "null_projector",
    "null_space",
    "principal_angles",
    "principal_components",
]


def null_space(jacobian: ArrayLike, *, rtol: float = 1e-9) -> NDArray[np.float64]:
    """Orthonormal basis of the joint motions that a task does not see.

    Parameters
    ----------
    jacobian : (k, n) array
        Task rates per joint rate; rows in m/rad, rad/rad, or a mixture.
    rtol : float
        Singular values up to ``rtol * largest`` count as zero.

    Returns
    -------
    (n - rank, n) array
        Orthonormal rows with ``jacobian @ row == 0``.

    Raises
    ------
    InvalidInput
        When the Jacobian is not a matrix of finite numbers.

    Examples
    --------
    >>> null_space([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]).round(6) ** 2
    array([[0., 0., 1.]])
    """
    J = np.asarray(jacobian, dtype=np.float64)
    if J.ndim != 2 or not np.isfinite(J).all():
        raise InvalidInput(
            f"expected a finite Jacobian (k, n), found an array {J.shape} "
            f"with {np.count_nonzero(~np.isfinite(J))} values that are not finite."
        )
    # Rows of zeros change nothing and make the full right basis come for free.
    k, n = J.shape
    _, s, vt = np.linalg.svd(np.vstack([J, np.zeros((max(n - k, 0), n))]))
    return vt[np.count_nonzero(_seen(s, rtol)) :]


def null_projector(jacobian: ArrayLike, *, rtol: float = 1e-9) -> NDArray[np.float64]:
    """Orthogonal projectors onto null spaces, whatever the rank of each.

    Parameters
    ----------
    jacobian : (..., k, n) array
        Task rates per joint rate, one Jacobian a posture.
    rtol : float
        Singular values up to ``rtol * largest`` (of the same posture) count as zero.

    Returns
    -------
    (..., n, n) array
        ``P`` with ``P @ P == P``, ``jacobian @ P == 0`` and trace ``n - rank``; NaN for
        postures whose Jacobian is not finite.

    Raises
    ------
    InvalidInput
        When the array has fewer than two axes.
    """
    J = np.asarray(jacobian, dtype=np.float64)
    if J.ndim < 2:
        raise InvalidInput(f"expected Jacobians (..., k, n), found an array {J.shape}.")
    finite = np.isfinite(J).all(axis=(-2, -1), keepdims=True)
    _, s, vt = np.linalg.svd(np.where(finite, J, 0.0), full_matrices=False)
    rows = vt * _seen(s, rtol)[..., None]
    projector = np.eye(J.shape[-1]) - np.swapaxes(rows, -2, -1) @ rows
    return np.where(finite, projector, np.nan)


def principal_angles(A: ArrayLike, B: ArrayLike) -> NDArray[np.float64]:
    """Angles between two subspaces, accurate from tiny ones to right angles.

    Cosines are the singular values of ``Qa' Qb``, sines those of ``Qb - Qa Qa' Qb``
    (Bjorck and Golub 1973). Each is exact to rounding in absolute terms, so
    ``atan2(sine, cosine)`` is too, on the whole quarter circle.

    Parameters
    ----------
    A : (..., p, n) array
        Rows spanning the first subspace; need not be orthonormal.
    B : (..., r, n) array
        Rows spanning the second.

    Returns
    -------
    (..., min(p, r)) array
        Radians in [0, pi/2], increasing.

    Raises
    ------
    InvalidInput
        When the spaces have different dimension, or rows are not finite or dependent.

    Examples
    --------
    >>> principal_angles([[1.0, 0.0, 0.0]], [[1.0, 1e-10, 0.0]])
    array([1.e-10])
    """
    a, b = _orthonormal_rows(A), _orthonormal_rows(B)
    if a.shape[-1] != b.shape[-1]:
        raise InvalidInput(
            f"expected subspaces of the same space, "
            f"found rows of length {a.shape[-1]} and {b.shape[-1]}."
        )
    if a.shape[-2] < b.shape[-2]:
        a, b = b, a
    overlap = b @ np.swapaxes(a, -2, -1)
    cosine = np.linalg.svd(overlap, compute_uv=False)
    sine = np.linalg.svd(b - overlap @ a, compute_uv=False)[..., ::-1]
    return np.arctan2(sine, cosine)


def mean_null_direction(
    jacobians: ArrayLike, d: int = 1, *, rtol: float = 1e-9
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Null space averaged over visited postures.

    The mean of the null-space projectors has eigenvalues between 0 and 1: an
    eigenvector with eigenvalue 1 lies in the null space of every posture. (For lines
    this is the Bingham mean direction, blind to the sign of each.)

    Parameters
    ----------
    jacobians : (N, k, n) array
        One Jacobian a visited posture; those that are not finite are left out.
    d : int
        How many directions.
    rtol : float
        Singular values up to ``rtol * largest`` count as zero.

    Returns
    -------
    directions : (d, n) array
        Leading eigenvectors as orthonormal rows, each with its largest entry positive.
    concentration : (n,) array
        All eigenvalues, decreasing; the first `d` belong to the directions. Where
        entry ``d`` is close to entry ``d - 1`` the directions are one choice of many.

    Raises
    ------
    InvalidInput
        When the array is not (N, k, n) or `d` is not between 1 and n.
    NotEnoughData
        When no Jacobian is finite.
    """
    J = np.asarray(jacobians, dtype=np.float64)
    if J.ndim != 3:
        raise InvalidInput(f"expected Jacobians (N, k, n), found an array {J.shape}.")
    if not 1 <= d <= J.shape[-1]:
        raise InvalidInput(
            f"expected between 1 and {J.shape[-1]} directions, asked for {d}."
        )
    J = J[np.isfinite(J).all(axis=(1, 2))]
    if not len(J):
        raise NotEnoughData("no posture has a finite Jacobian to average over.")
    values, vectors = np.linalg.eigh(null_projector(J, rtol=rtol).mean(axis=0))
    directions = largest_entry_positive(vectors[:, ::-1].T[:d])
    return directions, np.clip(values[::-1], 0.0, 1.0)


def principal_components(
    rows: NDArray[np.float64], *, centered: bool = True
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions in which vectors vary most.

    Parameters
    ----------
    rows : (N, n) array
        Vectors.
    centered : bool
        About their mean, or about zero.

    Returns
    -------
    components : (n, n) array
        Orthonormal rows of either sign, the one with most variance first.
    ratio : (n,) array
        Part of the total variance that each explains, decreasing; zeros where there is
        none but for rounding.
    """
    around = rows - rows.mean(axis=0) if centered else rows
    if np.abs(around).max() <= 1e-12 * np.abs(rows).max():
        return np.eye(rows.shape[1]), np.zeros(rows.shape[1])
    variances, vectors = np.linalg.eigh(around.T @ around)
    variances = np.clip(variances[::-1], 0.0, None)
    return vectors[:, ::-1].T, variances / variances.sum()


def largest_entry_positive(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows (d, n) turned over where their entry of largest magnitude is negative."""
    largest = np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1)
    return np.where(largest < 0, -rows, rows)


def _seen(s: NDArray[np.float64], rtol: float) -> NDArray[np.bool_]:
    """Which singular values (decreasing along the last axis) are not zero."""
    return np.greater(s, rtol * s[..., :1])


def _orthonormal_rows(rows: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(rows, dtype=np.float64)
    if array.ndim < 2 or 0 in array.shape or not np.isfinite(array).all():
        raise InvalidInput(
            f"expected a subspace as finite rows (..., p, n), found {array.shape}."
        )
    _, s, vt = np.linalg.svd(array, full_matrices=False)
    if array.shape[-2] > array.shape[-1] or not (s[..., -1] > 1e-12 * s[..., 0]).all():
        raise InvalidInput(
            f"expected linearly independent rows, found dependent ones in an array "
            f"{array.shape}."
        )
    return vt
