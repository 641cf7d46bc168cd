"""Linear subspaces of joint space: null spaces, angles between them, their average.

A subspace is an array of rows that span it. A Jacobian maps joint rates (rad/s) to task
rates; its rows may mix meters and radians. The null space itself does not depend on how
rows are scaled (``J n = 0`` row by row), but singular values do, and with them the
decision which of them are zero. The default ``rtol`` of 1e-9 is far below the ratios
due to a change of unit or an almost straight arm (1e-3 each) and far above rounding
(1e-16), so the decision is the same in meters and in millimeters.

Arrays of the wrong shape, and rows that are not finite where no NaN is promised, raise
InvalidInput.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ikns._kernels.principal_angles import write_principal_angles
from ikns._kernels.row_space import write_bases
from ikns.arrays import Array, Indices
from ikns.errors import InvalidInput, NotEnoughData

#: Rows count as dependent when their smallest singular value is at most this share of
#: the largest: far above rounding (1e-16), which would otherwise decide their span.
_DEPENDENT = 1e-12


def null_space(jacobian: ArrayLike, *, rtol: float = 1e-9) -> Array:
    """Orthonormal basis of the joint motions that leave a task unchanged.

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

    >>> null_space([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]).round(6) ** 2
    array([[0., 0., 1.]])
    """
    J = np.asarray(jacobian, dtype=np.float64)
    if J.ndim != 2 or not np.isfinite(J).all():
        raise InvalidInput(
            f"expected a finite Jacobian (k, n), found an array {J.shape} "
            f"with {np.count_nonzero(~np.isfinite(J))} values that are not finite."
        )
    basis, _ = null_spaces(J, rtol=rtol)
    return basis


def null_spaces(jacobians: ArrayLike, *, rtol: float = 1e-9) -> tuple[Array, Indices]:
    """Orthonormal bases of many null spaces, of any rank.

    Parameters
    ----------
    jacobians : (..., k, n) array
        Task rates per joint rate, one Jacobian per posture.
    rtol : float
        Singular values up to ``rtol * largest`` (of the same posture) count as zero; an
        `rtol` below rounding, 2e-16, is raised to it.

    Returns
    -------
    basis : (..., d, n) array
        ``n - rank`` orthonormal rows ``b`` with ``jacobian @ b == 0``, then rows of
        zeros; d is the largest such number, and ``basis.T @ basis`` the projector. NaN
        for postures whose Jacobian is not finite.
    rank : (...) integer array
        Rank of each Jacobian; -1 where it is not finite.

    >>> elbow_bent, straight = [[1.0, 0, 0], [0, 2.0, 0]], [[1.0, 0, 0], [2.0, 0, 0]]
    >>> basis, rank = null_spaces([elbow_bent, straight])
    >>> basis.shape, rank.tolist()
    ((2, 2, 3), [2, 1])
    """
    J = np.asarray(jacobians, dtype=np.float64)
    if J.ndim < 2:
        raise InvalidInput(f"expected Jacobians (..., k, n), found an array {J.shape}.")
    *batch, k, n = J.shape
    flat = _flat(J, tuple(batch))
    tolerance = max(rtol, np.finfo(float).eps)
    rank = np.empty(len(flat), dtype=np.int64)
    basis = np.empty((len(flat), max(n - k, 0), n))
    write_bases(flat, tolerance, False, basis, rank)
    deficient = n - int(rank[rank >= 0].min(initial=n))
    if deficient > basis.shape[1]:
        basis = np.empty((len(flat), deficient, n))
        write_bases(flat, tolerance, False, basis, rank)
    return basis.reshape(*batch, *basis.shape[1:]), rank.reshape(batch)


def null_projector(jacobian: ArrayLike) -> Array:
    """Orthogonal projectors (..., n, n) onto null spaces, of any rank.

    ``P`` with ``P @ P == P``, ``jacobian @ P == 0`` and trace ``n - rank``; NaN for
    postures whose Jacobian is not finite. Small singular values as in
    :func:`null_spaces`.
    """
    basis, rank = null_spaces(jacobian)
    projector = np.swapaxes(basis, -2, -1) @ basis
    projector[rank < 0] = np.nan
    return projector


def principal_angles(A: ArrayLike, B: ArrayLike) -> Array:
    """Principal angles between two subspaces, accurate from tiny to right angles.

    The method is that of :mod:`ikns._kernels.principal_angles`. Rows of A (..., p, n)
    and B (..., r, n) span the subspaces; they need not be orthonormal. The min(p, r)
    angles increase, radians in [0, pi/2].

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
    batch = np.broadcast_shapes(a.shape[:-2], b.shape[:-2])
    angles = np.empty((math.prod(batch), b.shape[-2]))
    write_principal_angles(_flat(a, batch), _flat(b, batch), angles)
    return angles.reshape(*batch, b.shape[-2])


def mean_null_direction(jacobians: ArrayLike, d: int = 1) -> tuple[Array, Array]:
    """Null space averaged over visited postures with finite Jacobians (N, k, n).

    The mean of the null-space projectors has eigenvalues between 0 and 1: an
    eigenvector with eigenvalue 1 lies in the null space of every posture. (For lines
    this is the Bingham mean direction, blind to the sign of each.)

    Returns
    -------
    directions : (d, n) array
        Leading eigenvectors as orthonormal rows, each with its largest entry positive.
    concentration : (n,) array
        All eigenvalues, decreasing; the first `d` belong to the directions. Where
        entry ``d`` is close to entry ``d - 1`` the directions are not unique.
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
    rows = null_spaces(J)[0].reshape(-1, J.shape[-1])
    values, vectors = np.linalg.eigh(rows.T @ rows / len(J))
    directions = largest_entry_positive(vectors[:, ::-1].T[:d])
    return directions, np.clip(values[::-1], 0.0, 1.0)


def principal_components(rows: Array, *, centered: bool = True) -> tuple[Array, Array]:
    """Principal components of vectors (N, n), about their mean or about zero.

    Returns
    -------
    components : (n, n) array
        Orthonormal rows of arbitrary sign, by decreasing variance.
    ratio : (n,) array
        Share of the total variance that each explains; zeros where there is no variance
        beyond rounding.
    """
    around = rows - rows.mean(axis=0) if centered else rows
    if np.abs(around).max() <= 1e-12 * np.abs(rows).max():
        return np.eye(rows.shape[1]), np.zeros(rows.shape[1])
    variances, vectors = np.linalg.eigh(around.T @ around)
    variances = np.clip(variances[::-1], 0.0, None)
    return vectors[:, ::-1].T, variances / variances.sum()


def largest_entry_positive(rows: Array) -> Array:
    """Rows (d, n), negated where their entry of largest magnitude is negative."""
    largest = np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1)
    return np.where(largest < 0, -rows, rows)


def _flat(matrices: Array, batch: tuple[int, ...]) -> Array:
    """Matrices as (N, k, n), in the memory layout that kernels are compiled for."""
    shape = matrices.shape[-2:]
    every = np.broadcast_to(matrices, (*batch, *shape))
    every = np.require(every, requirements=["C", "A", "W"])
    return every.reshape(math.prod(batch), *shape)


def _orthonormal_rows(rows: ArrayLike) -> Array:
    array = np.asarray(rows, dtype=np.float64)
    if array.ndim < 2 or 0 in array.shape[-2:] or not np.isfinite(array).all():
        raise InvalidInput(
            f"expected a subspace as finite rows (..., p, n), found {array.shape}."
        )
    flat = _flat(array, array.shape[:-2])
    basis, rank = np.empty_like(flat), np.empty(len(flat), dtype=np.int64)
    write_bases(flat, _DEPENDENT, True, basis, rank)
    if (rank < array.shape[-2]).any():
        raise InvalidInput(
            f"expected linearly independent rows, found dependent ones in an array "
            f"{array.shape}."
        )
    return basis.reshape(array.shape)
