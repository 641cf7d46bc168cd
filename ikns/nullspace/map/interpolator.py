"""Interpolation between points: natural neighbors, or the nearest point.

Natural neighbors need a volume, which one to three points, or points that are not in
space, do not have.
"""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.interpolation import NaturalNeighborInterpolator

__all__ = ["NearestPoint", "make_interpolator"]


def make_interpolator(
    points: NDArray[np.float64], outside: Literal["nearest", "project", "nan"]
) -> NaturalNeighborInterpolator | NearestPoint:
    """Interpolator between points (P, d): natural neighbors for 4 or more in space.

    Raises
    ------
    NotEnoughData
        When 4 or more points in space lie in a plane.
    """
    if points.shape[1] == 3 and len(points) >= 4:
        return NaturalNeighborInterpolator(points, outside=outside)
    return NearestPoint(points)


class NearestPoint:
    """Weights of 1 for the nearest point, in any dimension.

    Same methods as
    :class:`ikns.nullspace.interpolation.NaturalNeighborInterpolator`.

    Parameters
    ----------
    points : (P, d) array
        Where values are known.

    Attributes
    ----------
    points : (P, d) array
    edges : (P (P - 1) / 2, 2) integer array
        All pairs of points.
    """

    def __init__(self, points: ArrayLike) -> None:
        self.points = np.asarray(points, dtype=np.float64)
        pairs = list(itertools.combinations(range(len(self.points)), 2))
        self.edges = np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def weights(self, x: ArrayLike) -> NDArray[np.float64]:
        """Weights at queries (..., d), (..., P); NaN where a query is not finite."""
        queries = np.asarray(x, dtype=np.float64)
        flat = queries.reshape(-1, queries.shape[-1])
        known = np.isfinite(flat).all(axis=1)
        nearest, _ = nearest_center(flat[known], self.points, radius=np.inf)
        weights = np.full((len(flat), len(self.points)), np.nan)
        weights[known] = np.eye(len(self.points))[nearest]
        return weights.reshape(*queries.shape[:-1], -1)

    def inside(self, x: ArrayLike) -> NDArray[np.bool_]:
        """Return false for queries (..., d), (...): the points enclose no volume."""
        return np.zeros(np.shape(x)[:-1], dtype=bool)
