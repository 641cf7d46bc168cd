"""Natural-neighbor interpolation: a weighted mean of the sites around the query.

R. Sibson, A brief description of natural neighbour interpolation, in Interpreting
Multivariate Data (1981): the weight of a site is the share of the query's own Voronoi
cell that it had to give up.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput
from ikns.interpolation.border import checked_points, checked_values
from ikns.interpolation.faces import solid_angles
from ikns.interpolation.hull import nearest_on_hull
from ikns.interpolation.sibson import depths, stolen_volumes
from ikns.interpolation.twofold import difference
from ikns.interpolation.voronoi import voronoi

__all__ = ["NaturalNeighborInterpolator", "Outside"]

Outside = Literal["nearest", "project", "nan"]
Floats = NDArray[np.float64]

#: Queries nearer to the hull than this part of the way to the middle are moved in to
#: there. The hull of a box whose corners are rounded is uneven by 1e-16, and this near
#: to it weights would tell which way.
_SKIN = 1e-11
#: Faces that fill less than this much of a site's view, steradian, make no neighbors.
_GLIMPSE = 1e-9
#: Queries farther out are brought this near: only their direction matters there.
_FAR = 1e9


class NaturalNeighborInterpolator:
    """Exact Sibson interpolation between sites in space.

    Inside the convex hull the weights are at least 0, sum to 1, reproduce the query
    (``weights @ points == x``), are 1 at a site, continuous everywhere, and follow the
    sites under rotation, scaling and renumbering. Sites on a common sphere or in a
    common plane (boxes, grids) are as good as any.

    Parameters
    ----------
    points : (N, 3) array
        Sites, m; at least 4, all different, not all in one plane.
    values : (N, ...) array, optional
        What to interpolate; without it only :meth:`weights` can be asked.
    outside : {"nearest", "project", "nan"}
        Outside the hull: the value of the nearest site (the paper's rule; it jumps at
        the hull), the value at the nearest point of the hull (continuous), or NaN.

    Attributes
    ----------
    points : (N, 3) array
    values : (N, ...) array or None
    edges : (E, 2) integer array
        Pairs of sites whose Voronoi cells share a face: the Delaunay edges. Together
        they connect all sites. Cells that only touch in a point or a line do not count
        (a face must fill 1e-9 sr of its site's view), so there are no accidental
        diagonals: a box has 12 edges however its corners are rounded.
    simplices : (T, 4) integer array
        A Delaunay triangulation; ties are broken by the order of the sites.
    hull_facets : (H, 3) integer array
        Triangles of the convex hull, counterclockwise from outside.

    Raises
    ------
    NotEnoughData
        Fewer than 4 points, coincident points (closer than 1e-10 of the set's size), or
        points in a plane (thinner than 1e-9 of it).
    InvalidInput
        Points or values of the wrong shape or not finite; an unknown `outside`.

    Notes
    -----
    Measured against exact integer arithmetic, weights are off by about 1e-16, at most
    4e-14, on boxes, grids and random sites, turned, thin as 1e-7 of their width, or
    jittered by 1e-17 to 1e-1. Within 1e-11 of the way from the hull to the middle,
    weights are those at 1e-11. Where rounding leaves a query outside the hull it is
    moved in as well: on sets thinner than 1e-6 of their width, by more than 1e-10.

    Examples
    --------
    >>> import numpy as np
    >>> cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> height = NaturalNeighborInterpolator(cube, cube[:, 2])
    >>> height.weights([0.5, 0.5, 0.5])
    array([0.125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.125])
    >>> height([[0.5, 0.5, 0.25], [0.1, 0.2, 7.0]]).round(12)
    array([0.25, 1.  ])
    >>> len(height.edges), len(height.hull_facets)
    (12, 12)
    """

    def __init__(
        self,
        points: ArrayLike,
        values: ArrayLike | None = None,
        *,
        outside: Outside = "nearest",
    ) -> None:
        self.points = checked_points(points)
        self.values = None if values is None else checked_values(values, self.points)
        if outside not in get_args(Outside):
            raise InvalidInput(
                f"unknown outside '{outside}', expected one of {get_args(Outside)}."
            )
        self.outside: Outside = outside
        size = float(np.ptp(self.points, axis=0).max())
        # A power of two scales exactly.
        self._scale = 2.0 ** min(1000, -round(math.log2(size)))
        self._sites = self.points * self._scale
        self._voronoi = voronoi(self._sites)
        self._center = self._sites.mean(axis=0)
        self._center_depth = depths(
            self._voronoi, self._sites, self._center[None], np.zeros((1, 3))
        )[0]
        self._rounding = 8 * np.finfo(float).eps * max(1.0, np.abs(self._sites).max())
        self.simplices = self._voronoi.simplices
        self.hull_facets = self._voronoi.hull_facets
        self.edges = self._voronoi.edges[
            solid_angles(self._voronoi, self._sites) >= _GLIMPSE
        ]
        for array in (self.points, self.simplices, self.hull_facets, self.edges):
            array.flags.writeable = False

    def __call__(self, x: ArrayLike) -> Floats:
        """Interpolate the values.

        Parameters
        ----------
        x : (..., 3) array
            Queries, m. A query that is not finite gives NaN.

        Returns
        -------
        (..., value shape) array
        """
        if self.values is None:
            raise InvalidInput(
                "these points were given no values, only their weights can be asked."
            )
        return np.tensordot(self.weights(x), self.values, axes=1)

    def weights(self, x: ArrayLike) -> Floats:
        """Sibson weights of the sites.

        Parameters
        ----------
        x : (..., 3) array
            Queries, m. A query that is not finite gives NaN.

        Returns
        -------
        (..., N) array
        """
        queries, shape = self._scaled(x)
        weights = np.full((len(queries), len(self._sites)), np.nan)
        seen = np.flatnonzero(np.isfinite(queries).all(axis=1))
        step = max(1, 50_000 // len(self._voronoi.side_edge))  # blocks that fit a cache
        for start in range(0, len(seen), step):
            rows = seen[start : start + step]
            weights[rows] = self._block(queries[rows])
        return weights.reshape(*shape, len(self._sites))

    def inside(self, x: ArrayLike) -> NDArray[np.bool_]:
        """Whether queries are in the convex hull or, but for rounding, on it.

        Parameters
        ----------
        x : (..., 3) array
            Queries, m. A query that is not finite is not inside.

        Returns
        -------
        (...) boolean array
        """
        queries, shape = self._scaled(x)
        within = np.zeros(len(queries), dtype=bool)
        seen = np.flatnonzero(np.isfinite(queries).all(axis=1))
        step = max(1, 50_000 // len(self.hull_facets))
        for start in range(0, len(seen), step):
            rows = seen[start : start + step]
            within[rows] = self._depths(queries[rows]).min(axis=1) >= -self._rounding
        return within.reshape(shape)

    def _scaled(self, x: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
        queries = np.asarray(x, dtype=np.float64)
        if queries.ndim == 0 or queries.shape[-1] != 3:
            raise InvalidInput(
                f"expected queries of shape (..., 3), found {queries.shape}."
            )
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = queries.reshape(-1, 3) * self._scale
            away = scaled - self._center
            reach = np.abs(away).max(axis=1, initial=0)
            far = (reach > _FAR) & np.isfinite(reach)
        scaled[far] = self._center + away[far] / reach[far, None] * _FAR
        return scaled, queries.shape[:-1]

    def _depths(self, x: Floats) -> Floats:
        return depths(self._voronoi, self._sites, x, np.zeros_like(x))

    def _block(self, x: Floats) -> Floats:
        """Weights of finite, scaled queries, (Q, N)."""
        weights = np.full((len(x), len(self._sites)), np.nan)
        depth = self._depths(x)
        within = depth.min(axis=1) >= -self._rounding
        away = np.flatnonzero(~within)
        if self.outside == "project" and away.size:
            x = x.copy()
            x[away] = nearest_on_hull(self._sites, self.hull_facets, x[away])
            depth[away] = self._depths(x[away])
            within[:] = True
        elif self.outside == "nearest" and away.size:
            weights[away] = np.eye(len(self._sites))[self._nearest(x[away])[0]]

        rows = np.flatnonzero(within)
        nearest, square = self._nearest(x[rows])
        at_site = square <= 1e-36  # nearer, nothing could be told apart
        weights[rows[at_site]] = np.eye(len(self._sites))[nearest[at_site]]
        rows = rows[~at_site]
        weights[rows] = self._sibson(x[rows], depth[rows])
        return weights

    def _nearest(self, x: Floats) -> tuple[NDArray[np.intp], Floats]:
        square = ((x[:, None] - self._sites) ** 2).sum(axis=2)
        nearest = square.argmin(axis=1)
        return nearest, square[np.arange(len(x)), nearest]

    def _sibson(self, x: Floats, depth: Floats) -> Floats:
        """Weights of queries in the hull that are not sites."""
        # Part of the way from the hull to the middle: linear along every such ray.
        part = (depth / self._center_depth).min(axis=1, initial=np.inf)
        x, rest = x.copy(), np.zeros_like(x)  # may move by less than floats can tell
        low = np.flatnonzero(part < _SKIN)
        step = (_SKIN - part[low]) / (1 - part[low])
        x[low], rest[low] = difference(x[low], step[:, None] * (x[low] - self._center))
        depth[low] = depths(self._voronoi, self._sites, x[low], rest[low])
        volume = stolen_volumes(self._voronoi, self._sites, x, rest, depth)
        weights = volume / volume.sum(axis=1, keepdims=True)
        if not (weights >= -1e-9).all():  # never seen: rounding leaves -1e-15
            raise ArithmeticError(
                f"a natural-neighbor weight came out as {weights.min():g} where 0 or "
                "more is certain."
            )
        weights = weights.clip(0, None)
        return weights / weights.sum(axis=1, keepdims=True)
