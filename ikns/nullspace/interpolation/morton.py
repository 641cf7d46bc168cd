"""An order of places in which neighbors are mostly close together."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices

__all__ = ["morton_order"]

#: Bits for each axis: a cell for each of a billion sites.
_BITS = 10


def morton_order(places: Array, low: Array, high: Array) -> Indices:
    """Sort places along the Z-shaped curve (G. M. Morton, IBM, 1966).

    Parameters
    ----------
    places : (Q, 3) array
        Those that are not finite may come anywhere.
    low, high : (3,) array
        Corners of a box; places outside are taken for the nearest in it.

    Returns
    -------
    (Q,) integer array
        Which place is first, second, and so on.
    """
    share = (np.nan_to_num(places).clip(low, high) - low) / (high - low)
    cell = (share * (2**_BITS - 1)).astype(np.int64)
    code = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
