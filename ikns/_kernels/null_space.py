"""Orthonormal bases of null spaces, one a Jacobian: the axes that rows never reach.

Method and source: :mod:`ikns._kernels.row_space`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.row_space import reflected_axis, row_rank

__all__ = ["write_null_spaces"]

Floats = NDArray[np.float64]


@compiled
def write_null_spaces(
    jacobians: Floats, rtol: float, basis: Floats, rank: NDArray[np.int64]
) -> None:
    """Write the bases of (N, k, n) Jacobians to rows (N, d, n), and ranks (N,)."""
    count, k, n = jacobians.shape
    work, factors = np.empty((k, n)), np.empty(k)
    for i in range(count):
        rank[i] = row_rank(jacobians[i], rtol, work, factors)
        _write_basis(work, factors, rank[i], basis[i])


@compiled
def _write_basis(work: Floats, factors: Floats, rank: int, basis: Floats) -> None:
    """Fill rows (d, n) with as much of the basis as fits, then with zeros.

    NaN when the rank is -1.
    """
    d, n = basis.shape
    for row in range(d):
        if rank >= 0 and rank + row < n:
            reflected_axis(work, factors, rank, rank + row, basis[row])
        else:
            for j in range(n):
                basis[row, j] = np.nan if rank < 0 else 0.0
