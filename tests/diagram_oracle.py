"""The Voronoi diagram of a triangulation in integers: every number rounded once.

Every number is a ratio of integers times square roots of integers: a corner 1e15 away
and an angle of 1e-15 keep all their digits.
"""

import math
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np
from predicate_oracle import between, cross, dot, on_lattice

from ikns.nullspace.interpolation.voronoi import Voronoi

#: Vertex positions of the facets of (a, b, c, d), each turned away from the vertex it
#: leaves out, in that vertex's place.
OUTWARD = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))

_STEP = 2.0**-100  # of the integer lattice, in units of the set's size


class _Line(NamedTuple):
    """A Delaunay facet with its normal, and the tetrahedra that its line connects."""

    facet: tuple[int, int, int]
    normal: list[int]
    behind: int
    ahead: int
    length: float


class _Side(NamedTuple):
    """A line on its way about an edge: from which tetrahedron to which."""

    line: int
    entering: int
    leaving: int


def voronoi(points, simplices, neighbors):
    """Build the diagram of sites about 1 wide from lists of their tetrahedra."""
    sites = on_lattice(points)
    outside = len(simplices)
    centers = [_circumcenter(sites, simplex) for simplex in simplices]
    lines = _lines(sites, simplices, neighbors, centers)
    rings = _rings(lines, outside)
    edges = sorted(rings)
    sides = [(e, *side) for e, edge in enumerate(edges) for side in rings[edge]]
    side_edge, side_facet, entering, leaving = map(np.array, zip(*sides, strict=True))
    corner = np.array([[_rounded(v, below) for v in above] for above, below in centers])
    ahead = np.array([line.ahead for line in lines])
    hull = np.flatnonzero(ahead == outside)
    normal = np.array([_direction(line.normal) for line in lines])
    axes = np.array([_direction(between(sites[i], sites[j])) for i, j in edges])
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


def _circumcenter(sites, simplex):
    """Center of the sphere through four sites, seen from the first, as a fraction.

    The denominator is twelve times the signed volume.
    """
    u, v, w = (between(sites[simplex[0]], sites[i]) for i in simplex[1:])
    vw, wu, uv = cross(v, w), cross(w, u), cross(u, v)
    uu, vv, ww = dot(u, u), dot(v, v), dot(w, w)
    numerator = [uu * vw[k] + vv * wu[k] + ww * uv[k] for k in range(3)]
    return numerator, 2 * dot(u, vw)


def _lines(sites, simplices, neighbors, centers):
    """Every facet once, turned away from the tetrahedron behind it."""
    lines = []
    for here, simplex in enumerate(simplices):
        for there, places in zip(neighbors[here], OUTWARD, strict=True):
            if 0 <= there < here:
                continue
            a, b, c = (simplex[k] for k in places)
            n = cross(between(sites[a], sites[b]), between(sites[a], sites[c]))
            if there < 0:
                lines.append(_Line((a, b, c), n, here, len(simplices), math.inf))
                continue
            # From corner to corner, as a fraction; each is seen from its first site.
            u, p = centers[here]
            v, q = centers[there]
            shift = between(sites[simplex[0]], sites[simplices[there][0]])
            ascent = dot(v, n) * p - dot(u, n) * q + dot(shift, n) * p * q
            length = ascent / (p * q) / _length(n)
            lines.append(_Line((a, b, c), n, here, there, length))
    return lines


def _rings(lines, outside):
    """Sides of each edge's polygon, counterclockwise; from the ray, if there is one."""
    starts = {}
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


def _pairs(sites, lines, rings, edges):
    """Pairs of sides of one polygon, and the sines of the angles between them."""
    first, second, sine, pairs = [], [], [], []
    start = 0  # number of the polygon's first side
    for i, j in edges:
        pairs.append(len(first))
        axis = between(sites[i], sites[j])
        seen = [
            between(sites[i], sites[sum(lines[side.line].facet) - i - j])
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


def _rounded(numerator, denominator):
    """Float nearest to a fraction, and what that float rounds off."""
    value = numerator / denominator
    return value, float(Fraction(numerator, denominator) - Fraction(value))


def _length(v):
    return math.sqrt(dot(v, v))


def _direction(v):
    """Return v / |v|: its direction to twice a float's digits, its length to one."""
    length = Fraction(_length(v))
    return [_rounded(*(value / length).as_integer_ratio()) for value in v]
