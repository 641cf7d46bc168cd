"""Principal angles between subspaces, from sines and cosines.

With orthonormal rows a and b, the cosines are the singular values of ``b a'`` and the
sines those of ``b - (b a') a`` (Bjorck and Golub 1973, Math Comput 27:579). Each is
exact to rounding in absolute terms, and so is ``atan2(sine, cosine)`` on the whole
quarter circle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.row_space import orthogonalize, reflected_axis, row_rank

__all__ = ["write_principal_angles"]

Floats = NDArray[np.float64]


@compiled
def write_principal_angles(A: Floats, B: Floats, rtol: float, angles: Floats) -> bool:
    """Write the angles (N, r) between rows A (N, p, n) and B (N, r, n), r <= p.

    Increasing, rad. False when rows of a pair are dependent to `rtol` or not finite.
    """
    count, r = angles.shape
    p, n = A.shape[1:]
    a, b, overlap = np.empty((p, n)), np.empty((r, n)), np.empty((r, p))
    work_a, work_b = np.empty((p, n)), np.empty((r, n))
    squares, cosines = np.empty(p), np.empty(r)
    for pair in range(count):
        if not _orthonormal(A[pair], rtol, work_a, squares, a):
            return False
        if not _orthonormal(B[pair], rtol, work_b, squares, b):
            return False
        for i in range(r):
            for j in range(p):
                overlap[i, j] = 0.0
                for m in range(n):
                    overlap[i, j] += b[i, m] * a[j, m]
            for j in range(p):
                for m in range(n):
                    b[i, m] -= overlap[i, j] * a[j, m]
        orthogonalize(overlap, 0.0, cosines)
        orthogonalize(b, 0.0, squares)
        _sort(cosines, r)
        _sort(squares, r)
        for i in range(r):
            cosine = math.sqrt(cosines[r - 1 - i])
            angles[pair, i] = math.atan2(math.sqrt(squares[i]), cosine)
    return True


@compiled
def _orthonormal(
    rows: Floats, rtol: float, work: Floats, factors: Floats, basis: Floats
) -> bool:
    """Write an orthonormal basis of independent rows (p, n); tell if they are that."""
    p = rows.shape[0]
    rank = row_rank(rows, rtol, work, factors)
    for i in range(rank):
        reflected_axis(work, factors, rank, i, basis[i])
    return rank == p


@compiled
def _sort(values: Floats, count: int) -> None:
    """Sort the first values, few of them, upwards."""
    for i in range(1, count):
        j = i
        while j > 0 and values[j - 1] > values[j]:
            values[j - 1], values[j] = values[j], values[j - 1]
            j -= 1
