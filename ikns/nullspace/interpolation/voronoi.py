"""The Voronoi diagram of some sites, laid out so that one half-space cuts it fast.

Every number below is a ratio of integers times square roots of integers, rounded once:
a corner 1e15 away and an angle of 1e-15 keep all their digits. `diagram` does the same
in compiled code and is held to this. The words:

- corner: a Voronoi vertex, the center of the sphere through a tetrahedron;
- line: a Voronoi edge, at a right angle to a Delaunay facet, from the corner behind the
  facet to the corner ahead of it, or on to infinity where the facet is on the hull;
- edge: two sites i < j that are neighbors. Their cells share a polygon, at a right
  angle to the edge;
- side: one line of one polygon. The sides follow each other counterclockwise about the
  edge; the polygon of an edge of the hull is open, from ray to ray.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.nullspace.interpolation.delaunay import (
    OUTWARD,
    Facet,
    Simplex,
    Vector,
    circumcenter,
    cross,
    delaunay,
    dot,
    minus,
    on_lattice,
)

__all__ = ["Voronoi", "measured", "voronoi"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Edge = tuple[int, int]

_STEP = 2.0**-100  # of the integer lattice, in units of the set's size


@dataclass(frozen=True)
class Voronoi:
    """Delaunay triangulation and Voronoi diagram of N sites.

    T tetrahedra, F facets of which H are on the hull, E edges, S = 3 F sides, P pairs
    of sides of one polygon. Arrays are contiguous, of float64 and int64.

    Parameters
    ----------
    simplices : (T, 4) integer array
    neighbors : (T, 4) integer array
        The tetrahedron across the facet that leaves out each vertex; -1 on the hull.
    corner, corner_rest : (T, 3) array
        Corner seen from its tetrahedron's first site: float, and what it rounds off.
    behind, ahead : (F,) integer array
        Tetrahedra on the two sides of a facet; `ahead` is T on the hull.
    length : (F,) array
        Length of the line; infinite on the hull.
    normal, normal_rest : (F, 3) array
        Unit vector along the line: floats, and what these round off.
    hull : (H,) integer array
        Which facets are on the hull.
    hull_facets : (H, 3) integer array
        Their sites, counterclockwise from outside.
    edges : (E, 2) integer array
    axis : (E, 3) array
        Unit vector from site i to site j.
    side_facet, side_edge : (S,) integer array
        Facet and edge of a side.
    entering, leaving : (S,) integer array
        Tetrahedra at the start and at the end of the side; T at infinity.
    first, second : (P,) integer array
        The pair's sides, in the order of their places.
    sine : (P,) array
        Sine of the angle by which the second side turns from the first.
    pairs : (E,) integer array
        Where the pairs of an edge's polygon begin; they follow each other.
    """

    simplices: Indices
    neighbors: Indices
    corner: Floats
    corner_rest: Floats
    behind: Indices
    ahead: Indices
    length: Floats
    normal: Floats
    normal_rest: Floats
    hull: Indices
    hull_facets: Indices
    edges: Indices
    axis: Floats
    side_facet: Indices
    side_edge: Indices
    entering: Indices
    leaving: Indices
    first: Indices
    second: Indices
    sine: Floats
    pairs: Indices


class _Line(NamedTuple):
    """A Delaunay facet with its normal, and the tetrahedra that its line connects."""

    facet: Facet
    normal: Vector
    behind: int
    ahead: int
    length: float


class _Side(NamedTuple):
    """A line on its way about an edge: from which tetrahedron to which."""

    line: int
    entering: int
    leaving: int


def voronoi(points: Floats) -> Voronoi:
    """Build the diagram of sites that span space and are all different.

    Parameters
    ----------
    points : (N, 3) array
        Sites, scaled so that the set is about 1 wide.
    """
    return measured(points, *delaunay(points))


def measured(
    points: Floats, simplices: list[Simplex], neighbors: list[list[int]]
) -> Voronoi:
    """Build the diagram of sites from their triangulation.

    Parameters
    ----------
    points : (N, 3) array
        Sites, scaled so that the set is about 1 wide.
    simplices, neighbors
        As :func:`~ikns.nullspace.interpolation.delaunay.delaunay` returns them.
    """
    sites = on_lattice(points)
    outside = len(simplices)
    centers = [circumcenter(sites, simplex) for simplex in simplices]
    lines = _lines(sites, simplices, neighbors, centers)
    rings = _rings(lines, outside)
    edges = sorted(rings)
    sides = [(e, *side) for e, edge in enumerate(edges) for side in rings[edge]]
    side_edge, side_facet, entering, leaving = map(np.array, zip(*sides, strict=True))
    corner = np.array([[_rounded(v, below) for v in above] for above, below in centers])
    ahead = np.array([line.ahead for line in lines])
    hull = np.flatnonzero(ahead == outside)
    normal = np.array([_direction(line.normal) for line in lines])
    axes = np.array([_direction(minus(sites[j], sites[i])) for i, j in edges])
    return Voronoi(
        simplices=np.array(simplices),
        neighbors=np.array(neighbors),
        corner=corner[..., 0] * _STEP,
        corner_rest=corner[..., 1] * _STEP,
        behind=np.array([line.behind for line in lines]),
        ahead=ahead,
        length=np.array([line.length for line in lines]) * _STEP,
        normal=normal[..., 0].copy(),
        normal_rest=normal[..., 1].copy(),
        hull=hull,
        hull_facets=np.array([lines[k].facet for k in hull]),
        edges=np.array(edges),
        axis=axes[..., 0].copy(),
        side_facet=side_facet,
        side_edge=side_edge,
        entering=entering,
        leaving=leaving,
        **_pairs(sites, lines, rings, edges),
    )


def _lines(
    sites: list[Vector],
    simplices: list[Simplex],
    neighbors: list[list[int]],
    centers: list[tuple[Vector, int]],
) -> list[_Line]:
    """Every facet once, turned away from the tetrahedron behind it."""
    lines = []
    for here, simplex in enumerate(simplices):
        for there, places in zip(neighbors[here], OUTWARD, strict=True):
            if 0 <= there < here:
                continue
            a, b, c = (simplex[k] for k in places)
            n = cross(minus(sites[b], sites[a]), minus(sites[c], sites[a]))
            if there < 0:
                lines.append(_Line((a, b, c), n, here, len(simplices), math.inf))
                continue
            # From corner to corner, as a fraction; each is seen from its first site.
            u, p = centers[here]
            v, q = centers[there]
            shift = minus(sites[simplices[there][0]], sites[simplex[0]])
            ascent = dot(v, n) * p - dot(u, n) * q + dot(shift, n) * p * q
            length = ascent / (p * q) / _length(n)
            lines.append(_Line((a, b, c), n, here, there, length))
    return lines


def _rings(lines: list[_Line], outside: int) -> dict[Edge, list[_Side]]:
    """Sides of each edge's polygon, counterclockwise; from the ray, if there is one."""
    starts: dict[Edge, dict[int, _Side]] = {}
    for k, line in enumerate(lines):
        a, b, c = line.facet
        for i, j in ((a, b), (b, c), (c, a)):
            # Counterclockwise about an edge that runs along the facet's turn, the line
            # leads ahead; about the opposite edge it leads back.
            edge, side = (i, j), _Side(k, line.behind, line.ahead)
            if i > j:
                edge, side = (j, i), _Side(k, line.ahead, line.behind)
            starts.setdefault(edge, {})[side.entering] = side
    rings = {}
    for edge, onward in starts.items():
        at = outside if outside in onward else next(iter(onward))
        ring = []
        while at in onward:
            ring.append(onward.pop(at))
            at = ring[-1].leaving
        rings[edge] = ring
    return rings


def _pairs(
    sites: list[Vector],
    lines: list[_Line],
    rings: dict[Edge, list[_Side]],
    edges: list[Edge],
) -> dict[str, Any]:
    """Pairs of sides of one polygon, and the sines of the angles between them."""
    first: list[int] = []
    second: list[int] = []
    sine: list[float] = []
    pairs: list[int] = []
    start = 0  # number of the polygon's first side
    for i, j in edges:
        pairs.append(len(first))
        axis = minus(sites[j], sites[i])
        seen = [
            minus(sites[sum(lines[side.line].facet) - i - j], sites[i])
            for side in rings[i, j]
        ]  # the third sites of the facets around this edge
        across = [cross(axis, w) for w in seen]
        reach = [_length(v) for v in across]
        for x, y in combinations(range(len(seen)), 2):
            first.append(start + x)
            second.append(start + y)
            turn = dot(across[x], seen[y]) / reach[x] / reach[y]
            sine.append(turn * _length(axis))
        start += len(seen)
    return {
        "first": np.array(first),
        "second": np.array(second),
        "sine": np.array(sine),
        "pairs": np.array(pairs),
    }


def _rounded(numerator: int, denominator: int) -> tuple[float, float]:
    """Float nearest to a fraction, and what that float rounds off."""
    value = numerator / denominator
    return value, float(Fraction(numerator, denominator) - Fraction(value))


def _length(v: Vector) -> float:
    return math.sqrt(dot(v, v))


def _direction(v: Vector) -> list[tuple[float, float]]:
    """Return v / |v|: its direction to twice a float's digits, its length to one."""
    length = Fraction(_length(v))
    return [_rounded(*(value / length).as_integer_ratio()) for value in v]
