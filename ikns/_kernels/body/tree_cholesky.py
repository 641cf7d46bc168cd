"""Sparse Cholesky factorization for a branched tree of joints.

In the normal equations of a tree of joints two degrees of freedom are coupled only
where one carries the other. Factored as H = L' L from the leaves to the root, there is
no fill-in (Featherstone 2005, Efficient Factorization of the Joint-Space Inertia Matrix
for Branched Kinematic Trees, Int. J. Robotics Research 24: 487).

A row holds the degrees of freedom from the root to its own: entry a of row k is column
``path[k, a]``, and ``path[k, depth[k]]`` is k itself. The path to ``path[k, a]`` is the
first part of the same row, so rows are added entry by entry.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices


@compiled
def factor(H: Array, path: Indices, depth: Indices) -> bool:
    """Turn H (n, D), rows as above, into L in place; False if not positive definite."""
    for k in range(len(depth) - 1, -1, -1):
        last = depth[k]
        # A NaN is not greater than zero either.
        if not H[k, last] > 0:
            return False
        pivot = np.sqrt(H[k, last])
        H[k, last] = pivot
        for a in range(last):
            H[k, a] /= pivot
        for a in range(last):
            i, scale = path[k, a], H[k, a]
            for b in range(a + 1):
                H[i, b] -= scale * H[k, b]
    return True


@compiled
def solve(L: Array, path: Indices, depth: Indices, x: Array) -> None:
    """Solve L' L x = b in place, (n,)."""
    for i in range(len(depth) - 1, -1, -1):
        x[i] /= L[i, depth[i]]
        for a in range(depth[i]):
            x[path[i, a]] -= L[i, a] * x[i]
    for i in range(len(depth)):
        total = x[i]
        for a in range(depth[i]):
            total -= L[i, a] * x[path[i, a]]
        x[i] = total / L[i, depth[i]]
