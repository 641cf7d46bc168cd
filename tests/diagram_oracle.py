"""The Voronoi diagram of a triangulation in integers: every number rounded once.

Every number is a ratio of integers times square roots of integers: a circumcenter 1e15
away and an angle of 1e-15 keep all their digits.
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


class _Facet(NamedTuple):
    """A facet: normal, tetrahedra on both sides, length of its Voronoi edge."""

    sites: tuple[int, int, int]
    normal: list[int]
    behind: int
    ahead: int
    length: float


class _Side(NamedTuple):
    """A facet in the ring around an edge: from which tetrahedron to which."""

    facet: int
    entering: int
    leaving: int


def voronoi(points, simplices, neighbors):
    """Build the diagram of sites about 1 wide from lists of their tetrahedra."""
    sites = on_lattice(points)
    outside = len(simplices)
    centers = [_circumcenter(sites, simplex) for simplex in simplices]
    facets = _facets(sites, simplices, neighbors, centers)
    rings = _rings(facets, outside)
    edges = sorted(rings)
    sides = [(e, *side) for e, edge in enumerate(edges) for side in rings[edge]]
    side_edge, side_facet, entering, leaving = map(np.array, zip(*sides, strict=True))
    center = np.array([[_rounded(v, below) for v in above] for above, below in centers])
    ahead = np.array([facet.ahead for facet in facets])
    hull = np.flatnonzero(ahead == outside)
    normal = np.array([_direction(facet.normal) for facet in facets])
    axes = np.array([_direction(between(sites[i], sites[j])) for i, j in edges])
    return Voronoi(
        simplices=np.array(simplices),
        neighbors=np.array(neighbors),
        circumcenter=center[..., 0] * _STEP,
        circumcenter_rest=center[..., 1] * _STEP,
        behind=np.array([facet.behind for facet in facets]),
        ahead=ahead,
        length=np.array([facet.length for facet in facets]) * _STEP,
        normal=normal[..., 0].copy(),
        normal_rest=normal[..., 1].copy(),
        hull=hull,
        hull_facets=np.array([facets[k].sites for k in hull]),
        edges=np.array(edges),
        axis=axes[..., 0].copy(),
        side_facet=side_facet,
        side_edge=side_edge,
        entering=entering,
        leaving=leaving,
        **_pairs(sites, facets, rings, edges),
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


def _facets(sites, simplices, neighbors, centers):
    """Every facet once, turned away from the tetrahedron behind it."""
    facets = []
    for here, simplex in enumerate(simplices):
        for there, places in zip(neighbors[here], OUTWARD, strict=True):
            if 0 <= there < here:
                continue
            a, b, c = (simplex[k] for k in places)
            n = cross(between(sites[a], sites[b]), between(sites[a], sites[c]))
            if there < 0:
                facets.append(_Facet((a, b, c), n, here, len(simplices), math.inf))
                continue
            # From center to center, as a fraction; each is seen from its first site.
            u, p = centers[here]
            v, q = centers[there]
            shift = between(sites[simplex[0]], sites[simplices[there][0]])
            ascent = dot(v, n) * p - dot(u, n) * q + dot(shift, n) * p * q
            length = ascent / (p * q) / _length(n)
            facets.append(_Facet((a, b, c), n, here, there, length))
    return facets


def _rings(facets, outside):
    """Sides of each edge's face, counterclockwise; from the ray, if there is one."""
    starts = {}
    for k, facet in enumerate(facets):
        a, b, c = facet.sites
        for i, j in ((a, b), (b, c), (c, a)):
            # Counterclockwise about an edge in the direction of the facet's turn, its
            # Voronoi edge leads ahead; about the opposite edge it leads back.
            edge, side = (i, j), _Side(k, facet.behind, facet.ahead)
            if i > j:
                edge, side = (j, i), _Side(k, facet.ahead, facet.behind)
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


def _pairs(sites, facets, rings, edges):
    """Pairs of sides of one face, and the sines of the angles between them."""
    first, second, sine, pairs = [], [], [], []
    start = 0  # number of the face's first side
    for i, j in edges:
        pairs.append(len(first))
        axis = between(sites[i], sites[j])
        seen = [
            between(sites[i], sites[sum(facets[side.facet].sites) - i - j])
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
