"""Checks of what an interpolator is given: points, values, queries, output arrays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.errors import InvalidInput, NotEnoughData

# In sizes of the set: closer sites are taken for one, thinner sets for flat.
_COINCIDENT = 1e-10
_FLAT = 1e-9


def checked_points(points: ArrayLike) -> Array:
    """Return sites as an (N, 3) array, or say what is wrong with them."""
    found = np.array(points, dtype=np.float64)
    if found.ndim != 2 or found.shape[1] != 3:
        raise InvalidInput(f"expected points of shape (N, 3), found {found.shape}.")
    if not np.isfinite(found).all():
        first = int(np.flatnonzero(~np.isfinite(found).all(axis=1))[0])
        raise InvalidInput(
            f"all points must be finite, found {found[first]} at {first}."
        )
    if len(found) < 4:
        raise NotEnoughData(
            f"interpolation in space needs at least 4 points, found {len(found)}."
        )
    size = float(np.ptp(found, axis=0).max())
    for i, others in _candidates(found, _COINCIDENT * size):
        distance = np.abs(found[others] - found[i]).max(axis=1)
        j = int(distance.argmin())
        if distance[j] <= _COINCIDENT * size:
            raise NotEnoughData(
                f"all points must differ, but points {i} and {others[j]} are "
                f"{distance[j]:.1g} m apart in a set {size:.1g} m wide."
            )
    centered = found / size - (found / size).mean(axis=0)
    axes = np.linalg.svd(centered, full_matrices=False)[2]
    _, width, thickness = np.ptp(centered @ axes.T, axis=0) * size
    if thickness <= _FLAT * size:
        where = "on one line" if width <= _FLAT * size else "in one plane"
        raise NotEnoughData(
            f"the {len(found)} points must span a volume, but they lie {where} to "
            f"within {max(width if where == 'on one line' else 0, thickness):.1g} m."
        )
    return found


def _candidates(points: Array, near: float) -> Iterator[tuple[int, Indices]]:
    """Points, each with later ones that may be near: in no coordinate is a gap between.

    Points are told apart along x, then y, then z.
    """
    group = np.zeros(len(points), dtype=np.intp)
    for x in points.T:
        order = np.lexsort([x, group])
        apart = (np.diff(x[order]) > near) | (np.diff(group[order]) > 0)
        group[order[1:]] = apart.cumsum()
        group[order[0]] = 0
    for i in np.flatnonzero(np.bincount(group)[group] > 1):
        others = np.flatnonzero(group == group[i])
        if others[-1] > i:
            yield int(i), others[others > i]


def checked_values(values: ArrayLike, points: Array) -> Array:
    """Return values as a read-only (N, ...) array, or say what is wrong with them."""
    found = np.array(values, dtype=np.float64)
    if found.ndim == 0 or len(found) != len(points):
        raise InvalidInput(
            f"expected one value for each of the {len(points)} points, found values of "
            f"shape {found.shape}."
        )
    if not np.isfinite(found).all():
        raise InvalidInput("all values must be finite, found NaN or infinity.")
    found.flags.writeable = False
    return found


def checked_queries(x: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Return queries as (Q, 3), and the shape that they were given in."""
    queries = np.asarray(x, dtype=np.float64)
    if queries.ndim == 0 or queries.shape[-1] != 3:
        raise InvalidInput(
            f"expected queries of shape (..., 3), found {queries.shape}."
        )
    # Compiled code knows only arrays that are contiguous and could be written.
    flat = np.require(queries.reshape(-1, 3), requirements=["C", "W"])
    return flat, queries.shape[:-1]


def checked_out(out: Array | None, shape: tuple[int, ...]) -> Array:
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
