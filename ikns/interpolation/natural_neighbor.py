"""Natural-neighbor interpolation: a weighted mean of the sites around the query.

R. Sibson, A brief description of natural neighbour interpolation, in Interpreting
Multivariate Data (1981): the weight of a site is the share of the query's own Voronoi
cell that it had to give up.
"""

from __future__ import annotations

import threading
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns._kernels.diagram import UNSURE, new_work
from ikns._kernels.natural_neighbor import (
    interpolate_many,
    interpolate_one,
    weigh_many,
)
from ikns.errors import InvalidInput
from ikns.interpolation.border import checked_points, checked_values
from ikns.interpolation.domain import domain
from ikns.interpolation.faces import solid_angles
from ikns.interpolation.packed import packed
from ikns.interpolation.reference import (
    Outside,
    placed,
    reference_weights,
    scaled,
)

__all__ = ["NaturalNeighborInterpolator", "Outside"]

Floats = NDArray[np.float64]

_FLOAT = np.dtype(np.float64)
#: Faces that fill less than this much of a site's view, steradian, make no neighbors.
_GLIMPSE = 1e-9


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
        self._space = domain(self.points)
        diagram, n = self._space.diagram, len(self.points)
        flat = np.empty((n, 0)) if self.values is None else self.values.reshape(n, -1)
        self.packed = packed(self._space, flat, "sibson", outside)
        self._width = flat.shape[1]
        self._scratch = threading.local()
        self.simplices = diagram.simplices
        self.hull_facets = diagram.hull_facets
        self.edges = diagram.edges[solid_angles(diagram, self._space.sites) >= _GLIMPSE]
        for array in (self.points, self.simplices, self.hull_facets, self.edges):
            array.flags.writeable = False

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the threads' scratch memory."""
        return {name: v for name, v in self.__dict__.items() if name != "_scratch"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Start with no scratch memory."""
        self.__dict__.update(state, _scratch=threading.local())

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
        numbers, indices = self.packed
        if type(x) is np.ndarray and x.dtype is _FLOAT and x.shape == (3,):
            out = np.empty(self._width)
            status = interpolate_one(numbers, indices, *x.tolist(), self._work(), out)
            if status != UNSURE:
                return out.reshape(self.values.shape[1:])
        queries, shape = self._checked(x)
        found = np.empty((len(queries), self._width))
        state = np.empty(len(queries), dtype=np.int64)
        order = np.arange(len(queries))
        interpolate_many(numbers, indices, queries, order, self._work(), found, state)
        again = np.flatnonzero(state == UNSURE)
        if again.size:
            weights = reference_weights(self._space, queries[again], self.outside)
            found[again] = weights @ self.values.reshape(len(self.points), -1)
        return found.reshape((*shape, *self.values.shape[1:]))

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
        queries, shape = self._checked(x)
        found = np.empty((len(queries), len(self.points)))
        state = np.empty(len(queries), dtype=np.int64)
        order = np.arange(len(queries))
        weigh_many(*self.packed, queries, order, self._work(), found, state)
        again = np.flatnonzero(state == UNSURE)
        if again.size:
            found[again] = reference_weights(self._space, queries[again], self.outside)
        return found.reshape(*shape, len(self.points))

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
        queries, shape = self._checked(x)
        queries = scaled(self._space, queries)
        within = np.zeros(len(queries), dtype=bool)
        seen = np.flatnonzero(np.isfinite(queries).all(axis=1))
        step = max(1, 50_000 // len(self.hull_facets))
        for start in range(0, len(seen), step):
            rows = seen[start : start + step]
            within[rows] = placed(self._space, queries[rows], "nan")[1]
        return within.reshape(shape)

    def _checked(self, x: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
        queries = np.ascontiguousarray(x, dtype=np.float64)
        if queries.ndim == 0 or queries.shape[-1] != 3:
            raise InvalidInput(
                f"expected queries of shape (..., 3), found {np.shape(x)}."
            )
        # A copy where needed: compiled code knows only arrays that could be written.
        flat = np.require(queries.reshape(-1, 3), requirements=["C", "W"])
        return flat, queries.shape[:-1]

    def _work(self) -> Floats:
        """Scratch memory of this thread."""
        if not hasattr(self._scratch, "work"):
            self._scratch.work = new_work(self.packed[1])
        work: Floats = self._scratch.work
        return work
