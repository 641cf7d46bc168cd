"""Products of vectors."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3) and (..., 3), of broadcast shape.

    `numpy.cross` also takes plane vectors and other axes; for single vectors, which
    simulated people need by the ten thousand, looking for them takes most of the time.

    >>> cross(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])).tolist()
    [0.0, 0.0, 1.0]
    """
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    first = y * w - z * v
    product = np.empty((*np.shape(first), 3))
    product[..., 0], product[..., 1], product[..., 2] = (
        first,
        z * u - x * w,
        x * v - y * u,
    )
    return product
