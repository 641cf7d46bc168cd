"""What can be asked of an interpolator, and where to write answers, checked once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput

__all__ = ["checked_out", "checked_queries"]

Floats = NDArray[np.float64]


def checked_queries(x: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
    """Return queries as (Q, 3), and the shape that they were given in."""
    queries = np.asarray(x, dtype=np.float64)
    if queries.ndim == 0 or queries.shape[-1] != 3:
        raise InvalidInput(
            f"expected queries of shape (..., 3), found {queries.shape}."
        )
    # Compiled code knows only arrays that are contiguous and could be written.
    flat = np.require(queries.reshape(-1, 3), requirements=["C", "W"])
    return flat, queries.shape[:-1]


def checked_out(out: Floats | None, shape: tuple[int, ...]) -> Floats:
    """Return the array to write to: a new one, where none is given."""
    if out is None:
        return np.empty(shape)
    if not (
        isinstance(out, np.ndarray)
        and out.shape == shape
        and out.dtype == np.float64
        and out.flags.carray
    ):
        raise InvalidInput(
            "expected out to be a writeable, C-contiguous float64 array of shape "
            f"{shape}."
        )
    return out
