"""Distances between points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array


def distances(a: ArrayLike, b: ArrayLike) -> Array:
    """Distance of each of points (N, d) to each of points (P, d), (N, P).

    As ``scipy.spatial.distance.cdist``, whose import takes longer than most commands.

    >>> distances([[0.0, 0.0]], [[3.0, 4.0], [0.0, 1.0]]).tolist()
    [[5.0, 1.0]]
    """
    rows, columns = np.asarray(a, np.float64), np.asarray(b, np.float64)
    total = np.zeros((len(rows), len(columns)))
    for x, y in zip(rows.T, columns.T, strict=True):
        total += (x[:, None] - y) ** 2
    root: Array = np.sqrt(total, out=total)
    return root
