"""Between the points: natural neighbors, the nearest point, or a smooth field.

Natural neighbors need a volume. One to three points, or points that are not in space,
have none, and the nearest point's values hold.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices, Mask
from ikns.errors import InvalidInput
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.interpolation import NaturalNeighborInterpolator

if TYPE_CHECKING:
    from ikns.nullspace.map.smooth import SmoothField

Interpolation = Literal["natural", "laplace", "nearest", "smooth"]

_METHODS: dict[str, Literal["sibson", "laplace"]] = {
    "natural": "sibson",
    "laplace": "laplace",
}


def make_interpolator(
    points: Array,
    outside: Literal["nearest", "project", "nan"],
    interpolation: Interpolation = "natural",
) -> NaturalNeighborInterpolator | NearestPoint | SmoothField:
    """Interpolator between points (P, d): natural neighbors for 4 or more in space.

    Options and errors are those of :class:`ikns.NullSpaceMap`.
    """
    known = (*_METHODS, "nearest", "smooth")
    if interpolation not in known:
        raise InvalidInput(
            f"expected interpolation as one of {known}, found '{interpolation}'."
        )
    if interpolation == "smooth":
        from ikns.nullspace.map.smooth import SmoothField

        return SmoothField(points, edges=NearestPoint(points).edges)
    if interpolation == "nearest" or not _in_space(points):
        return NearestPoint(points)
    return NaturalNeighborInterpolator(
        points, outside=outside, method=_METHODS[interpolation]
    )


def _in_space(points: Array) -> bool:
    return points.shape[1] == 3 and len(points) >= 4


class NearestPoint:
    """Weights of 1 for the nearest of points (P, d), in any dimension.

    Same methods as :class:`ikns.nullspace.interpolation.NaturalNeighborInterpolator`.
    """

    def __init__(self, points: ArrayLike) -> None:
        self.points = np.asarray(points, dtype=np.float64)

    @property
    def edges(self) -> Indices:
        """Pairs of neighbors, (E, 2): of 4 points and more in space natural ones.

        Of others all pairs.
        """
        if _in_space(self.points):
            return NaturalNeighborInterpolator(self.points).edges
        pairs = list(itertools.combinations(range(len(self.points)), 2))
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def weights(self, x: ArrayLike) -> Array:
        """Weights at queries (..., d), (..., P); NaN where a query is not finite."""
        queries = np.asarray(x, dtype=np.float64)
        flat = queries.reshape(-1, queries.shape[-1])
        known = np.isfinite(flat).all(axis=1)
        nearest, _ = nearest_center(flat[known], self.points, radius=np.inf)
        weights = np.full((len(flat), len(self.points)), np.nan)
        weights[known] = np.eye(len(self.points))[nearest]
        return weights.reshape(*queries.shape[:-1], len(self.points))

    def inside(self, x: ArrayLike) -> Mask:
        """Return false for queries (..., d), (...): the points enclose no volume."""
        return np.zeros(np.shape(x)[:-1], dtype=bool)
