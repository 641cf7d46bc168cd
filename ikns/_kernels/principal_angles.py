"""Principal angles between subspaces, from sines and cosines.

With orthonormal rows a and b, the cosines are the singular values of ``b a'`` and the
sines those of ``b - (b a') a`` (Bjorck and Golub 1973, Math Comput 27:579). Each is
exact to rounding in absolute terms, and so is ``atan2(sine, cosine)`` from 0 to pi/2.
"""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.row_space import orthogonalize
from ikns.arrays import Array


@compiled
def write_principal_angles(A: Array, B: Array, angles: Array) -> None:
    """Write the angles (N, r) between rows A (N, p, n) and B (N, r, n), r <= p.

    The rows are orthonormal; angles increase, rad.
    """
    count, r = angles.shape
    p, n = A.shape[1:]
    overlap, rest = np.empty((r, p)), np.empty((r, n))
    cosines, sines = np.empty(r), np.empty(r)
    for pair in range(count):
        for i in range(r):
            for m in range(n):
                rest[i, m] = B[pair, i, m]
            for j in range(p):
                overlap[i, j] = 0.0
                for m in range(n):
                    overlap[i, j] += B[pair, i, m] * A[pair, j, m]
                for m in range(n):
                    rest[i, m] -= overlap[i, j] * A[pair, j, m]
        orthogonalize(overlap, 0.0, cosines)
        orthogonalize(rest, 0.0, sines)
        _sort(cosines)
        _sort(sines)
        for i in range(r):
            cosine = math.sqrt(cosines[r - 1 - i])
            angles[pair, i] = math.atan2(math.sqrt(sines[i]), cosine)


@compiled
def _sort(values: Array) -> None:
    """Sort a few values in increasing order."""
    for i in range(1, len(values)):
        j = i
        while j > 0 and values[j - 1] > values[j]:
            values[j - 1], values[j] = values[j], values[j - 1]
            j -= 1
