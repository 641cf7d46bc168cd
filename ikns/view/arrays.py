"""Arrays of figures: checks, and directions away from their middle."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput


def series(values: ArrayLike, name: str) -> Array:
    """Return `values` as a float array with one axis."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise InvalidInput(f"expected {name} (n,), found {array.shape}.")
    return array


def outward(points: Array) -> Array:
    """Return unit vectors from the mean of points (n, 3) to each; zero at the mean.

    >>> outward(np.array([[1.0, 0, 0], [-1.0, 0, 0], [0.0, 0, 0]]))[:, 0]
    array([ 1., -1.,  0.])
    """
    away = points - points.mean(axis=0)
    length = np.linalg.norm(away, axis=1, keepdims=True)
    return np.divide(away, length, out=np.zeros_like(away), where=length > 0)


def same_length(**arrays: NDArray[Any]) -> None:
    """Refuse arrays whose first axes differ in length."""
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} {n}" for name, n in lengths.items())
        raise InvalidInput(f"expected arrays of one length, found {found}.")
