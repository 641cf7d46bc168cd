"""Checks of the arrays that figures take."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput

__all__ = ["same_length", "series"]


def series(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return `values` as a float array with one axis."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise InvalidInput(f"expected {name} (n,), found {array.shape}.")
    return array


def same_length(**arrays: NDArray[Any]) -> None:
    """Refuse arrays whose first axes differ in length."""
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} {n}" for name, n in lengths.items())
        raise InvalidInput(f"expected arrays of one length, found {found}.")
