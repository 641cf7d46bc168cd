"""Orthonormal bases of the null spaces or row spaces of matrices.

Method and source: :mod:`ikns._kernels.row_space`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.row_space import careful_rank, certain_rank, reflected_axis

__all__ = ["write_bases"]

Floats = NDArray[np.float64]


@compiled
def write_bases(
    matrices: Floats,
    rtol: float,
    of_rows: bool,
    basis: Floats,
    rank: NDArray[np.int64],
) -> None:
    """Write bases of (N, k, n) matrices to rows (N, d, n), and their ranks (N,).

    Of the row spaces if `of_rows`, else of the null spaces; cut to d rows, or filled
    with zeros. NaN and -1 where a matrix is not finite.
    """
    count, k, n = matrices.shape
    work, factors = np.empty((k, n)), np.empty(k)
    for i in range(count):
        r = certain_rank(matrices[i], rtol, work, factors)
        if r < 0:
            r = careful_rank(matrices[i], rtol, work, factors)
        rank[i] = r
        first, last = (0, r) if of_rows else (r, n)
        for row in range(basis.shape[1]):
            if r >= 0 and first + row < last:
                reflected_axis(work, factors, r, first + row, basis[i, row])
            else:
                for j in range(n):
                    basis[i, row, j] = np.nan if r < 0 else 0.0
