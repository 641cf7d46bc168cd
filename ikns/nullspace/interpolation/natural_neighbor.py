"""Natural-neighbor interpolation: a weighted mean of the sites around the query.

R. Sibson, A brief description of natural neighbour interpolation, in Interpreting
Multivariate Data (1981): the weight of a site is the share of the query's own Voronoi
cell that it had to give up.
"""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

import numpy as np
from numpy import empty, ndarray
from numpy.typing import ArrayLike

from ikns._kernels.voronoi.batch import answer_batch, batch_scratch_rows
from ikns._kernels.voronoi.diagram import TETRAHEDRA, UNSURE
from ikns._kernels.voronoi.hull import inside_many
from ikns._kernels.voronoi.query import answer_many, answer_one
from ikns.arrays import Array, Indices, Mask
from ikns.errors import InvalidInput
from ikns.nullspace.interpolation.domain import domain, scaled_gradients
from ikns.nullspace.interpolation.inputs import (
    checked_out,
    checked_points,
    checked_queries,
    checked_values,
)
from ikns.nullspace.interpolation.packed import BRUTE_FORCE_LIMIT, morton_order, packed

Method = Literal["sibson", "laplace", "sibson_c1"]
Outside = Literal["nearest", "project", "nan"]

_FLOAT = np.dtype(np.float64)
#: Sites whose face has a smaller solid angle are no neighbors, steradian.
_MIN_SOLID_ANGLE = 1e-9
#: Queries of a batch: enough for vector instructions, few enough for the cache.
_BATCH = 64
#: For fewer queries neither a batch nor an order pays (measured).
_MIN_BATCH = 8


class NaturalNeighborInterpolator:
    """Exact natural-neighbor interpolation between sites in space.

    Inside the convex hull the weights are at least 0, sum to 1, reproduce the query
    (``weights @ points == x``), are 1 at a site, continuous everywhere, and follow the
    sites under rotation, scaling and renumbering. Sites on a common sphere or in a
    common plane (boxes, grids) need no special care.

    Parameters
    ----------
    points : (N, 3) array
        Sites, m; at least 4, all different, not all in one plane.
    values : (N, ...) array, optional
        What to interpolate; without it only :meth:`weights` is available.
    outside : {"nearest", "project", "nan"}
        Outside the hull: the value of the nearest site (the paper's rule; it jumps at
        the hull), the value at the nearest point of the hull (continuous), or NaN.
    method : {"sibson", "laplace", "sibson_c1"}
        Sibson's weights: the volume that the query's Voronoi cell takes from the
        site's. Laplace's: the area of the face between these cells over the distance.
        Both are smooth (C1) inside the hull but at the sites, where values have peaks.

        Sibson's smooth interpolant: his weights and tangent planes at the sites. C1
        everywhere inside the hull, with the gradients at the sites that are given or
        estimated. Exact for linear functions, and with exact gradients for spherical
        quadratics, ``a + b . x + c |x|**2``. Values may exceed those of the sites.
    gradients : (N, ..., 3) array, optional
        For "sibson_c1": of the values, per m. By default they are estimated: the plane
        through each site's value that is nearest to its neighbors'.

    Attributes
    ----------
    points : (N, 3) array
    values : (N, ...) array or None
    edges : (E, 2) integer array
        Pairs of sites whose Voronoi cells share a face: the Delaunay edges. Together
        they connect all sites. Cells that only touch in a point or a line do not count
        (a face needs a solid angle of 1e-9 sr), so there are no accidental
        diagonals: a box has 12 edges however its corners are rounded.
    simplices : (T, 4) integer array
        A Delaunay triangulation; ties are broken by the order of the sites.
    hull_facets : (H, 3) integer array
        Triangles of the convex hull, counterclockwise from outside.
    gradients : (N, ..., 3) array or None
        Those in use.

    Raises
    ------
    NotEnoughData
        Fewer than 4 points, coincident points (closer than 1e-10 of the set's size), or
        points in a plane (thinner than 1e-9 of it).
    InvalidInput
        Points, values or gradients of the wrong shape or not finite; an unknown option.

    Notes
    -----
    Measured against exact integer arithmetic, weights are off by about 1e-16, at most
    4e-14, on boxes, grids and random sites, turned, thin as 1e-7 of their width, or
    jittered by 1e-17 to 1e-1. Within 1e-11 of the way from the hull to the middle,
    weights are those at 1e-11. Where rounding leaves a query outside the hull it is
    moved in as well: on sets thinner than 1e-6 of their width, by more than 1e-10.

    Queries are answered by compiled code, one or many at a time, which may round
    differently. Where the result is unreliable (a weight below -1e-9, or no
    circumsphere found around the query), weights and values are NaN. No such query is
    known, unless the diagram was damaged on purpose.

    One interpolator can be used by many threads at once.

    V. V. Belikov et al., The non-Sibsonian interpolation (1997).

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
        method: Method = "sibson",
        gradients: ArrayLike | None = None,
    ) -> None:
        self.points = checked_points(points)
        self.values = None if values is None else checked_values(values, self.points)
        for option, given, known in (
            ("outside", outside, get_args(Outside)),
            ("method", method, get_args(Method)),
        ):
            if given not in known:
                raise InvalidInput(
                    f"unknown {option} '{given}', expected one of {known}."
                )
        self.outside: Outside = outside
        self.method: Method = method
        self._space = domain(self.points)
        diagram, n = self._space.diagram, len(self.points)
        self.simplices = diagram.simplices
        self.hull_facets = diagram.hull_facets
        angle = diagram.solid_angles(self._space.sites)
        self.edges = diagram.edges[angle >= _MIN_SOLID_ANGLE]

        there = np.empty((n, 0)) if self.values is None else self.values
        self._flat = there.reshape(n, -1)
        self._each = there.shape[1:], (n,)  # shapes of a value and of weights
        self._width, self._is_row = self._flat.shape[1], there.ndim == 2
        self._gradients = np.empty((n, 0, 3))
        self.gradients: Array | None = None
        if method == "sibson_c1":
            self._gradients = scaled_gradients(
                self._space, angle, self.values, gradients
            )
            self.gradients = self._gradients * self._space.scale
            self.gradients = self.gradients.reshape(*there.shape, 3)
        elif gradients is not None:
            raise InvalidInput("gradients are only for method='sibson_c1'.")
        self._diagram = packed(
            self._space, self._flat, self._gradients, method, outside
        )
        # Copies that no thread is using: queries write to the one they take.
        self._idle: list[Array] = []
        for array in (self.points, self.simplices, self.hull_facets, self.edges):
            array.flags.writeable = False

    @property
    def packed(self) -> tuple[Array, Indices]:
        """All that compiled code needs, one array read as floats and as integers.

        For :func:`ikns._kernels.voronoi.query.natural_weights`; not to be changed.
        """
        return self._diagram, self._diagram.view(np.int64)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out scratch memory."""
        return {**self.__dict__, "_idle": []}

    def __call__(self, x: ArrayLike, *, out: Array | None = None) -> Array:
        """Interpolate the values.

        Parameters
        ----------
        x : (..., 3) array
            Queries, m. A query that is not finite gives NaN.
        out : (..., value shape) array, optional
            Where to write them: float64, C-contiguous.

        Returns
        -------
        (..., value shape) array
        """
        # The live loop asks one query at a time: nothing here that is not needed.
        if type(x) is ndarray and x.dtype is _FLOAT and x.ndim == 1 and out is None:
            if self._width and x.flags.carray:
                found = empty(self._width)
                try:
                    diagram = self._idle.pop()
                except IndexError:
                    diagram = self._diagram.copy()
                answered = answer_one(diagram, x, found)
                self._idle.append(diagram)
                if answered:
                    return found if self._is_row else found.reshape(self._each[0])
        if self.values is None:
            raise InvalidInput(
                "these points were given no values, only their weights can be asked."
            )
        return self._answer(x, 0, out)

    def weights(self, x: ArrayLike, *, out: Array | None = None) -> Array:
        """Weights of the sites, (..., N); arguments as those of a call.

        For "sibson_c1", whose values also depend on gradients, this raises an error.
        """
        if self.method == "sibson_c1":
            raise InvalidInput(
                "values of method 'sibson_c1' depend on gradients too, not on weights "
                "alone; method='sibson' has weights."
            )
        return self._answer(x, 1, out)

    def inside(self, x: ArrayLike) -> Mask:
        """Whether queries (..., 3) are in the convex hull or, but for rounding, on it.

        A query that is not finite is not inside.
        """
        queries, shape = checked_queries(x)
        within = np.empty(len(queries), dtype=bool)
        diagram = self._taken()
        inside_many(diagram, queries, within)
        self._idle.append(diagram)
        return within.reshape(shape)

    def _answer(self, x: ArrayLike, weigh: int, out: Array | None) -> Array:
        """Answer queries with weights or with values."""
        each = self._each[weigh]
        queries, shape = checked_queries(x)
        found = checked_out(out, (*shape, *each))
        answers = found.reshape(len(queries), math.prod(each))
        self._answer_many(queries, weigh, answers)
        return found

    def _answer_many(self, x: Array, weigh: int, found: Array) -> None:
        """Write the weights or values of (Q, 3) queries."""
        diagram, indices = self.packed
        state = np.full(len(x), UNSURE)
        if len(x) < _MIN_BATCH:
            order = np.arange(len(x))
        elif indices[TETRAHEDRA] <= BRUTE_FORCE_LIMIT and self.method != "sibson_c1":
            work = np.empty((batch_scratch_rows(indices), min(_BATCH, len(x))))
            answer_batch(diagram, indices, x, work, weigh, found, state)
            order = np.flatnonzero(state == UNSURE)
        else:
            order = morton_order(x, self.points.min(axis=0), self.points.max(axis=0))
        diagram = self._taken()
        answer_many(diagram, x, order, weigh, found, state)
        self._idle.append(diagram)

    def _taken(self) -> Array:
        """Return a copy of the diagram that no other thread has."""
        try:
            return self._idle.pop()
        except IndexError:
            return self._diagram.copy()
