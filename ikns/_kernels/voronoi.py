"""The Voronoi diagram of a triangulation, every number as exact as a float can be.

With the edges u, v, w of a tetrahedron and six times its volume, d = u . (v x w), its
circumcenter is

    c = (|u|^2 v x w + |v|^2 w x u + |w|^2 u x v) / (2 d)

seen from its first site. Across a facet with normal n (|n| is twice its area), from the
tetrahedron with d_1 to that with d_2, the Voronoi edge has the length

    L = p d_1 |n| / (2 d_1 d_2)

where p is the power, to the first sphere, of the site that the second tetrahedron adds:
the two powers differ by 2 L times the height above the facet, and that site's is
d_2 / |n|. All of n, d, 2 d c and p d are determinants of the sites; they are formed
without rounding (`exact`), so what nearly cancels keeps its digits and ties are 0.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.exact import (
    CENTER,
    DETERMINANT,
    NORMAL,
    POWER,
    SCRATCH,
    SPHERE,
    TO_SPHERE,
    UV,
    VOLUME,
    VW,
    WU,
    Sites,
    T,
    U,
    V,
    compute,
    lattice,
    load,
    reach,
    turn,
    value_of,
)
from ikns._kernels.twofold import product

__all__ = ["lines", "rings", "sines", "spheres"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: First row of scratch for the third sites of the facets around an edge.
_SEEN = np.int64(SCRATCH[0])
#: Vertices of a facet in turn, seen from outside.
_OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@compiled
def lines(
    simplices: Integers, neighbors: Integers
) -> tuple[Integers, Integers, Integers, Integers]:
    """Every facet once, turned away from the tetrahedron behind it.

    Returns
    -------
    facets : (F, 3) integer array
        Their sites, counterclockwise from ahead.
    behind, ahead : (F,) integer array
        Tetrahedra on the two sides; T outside the hull.
    place : (F,) integer array
        Place, in the tetrahedron behind, of the vertex that the facet leaves out.
    """
    outside = len(simplices)
    count = 0
    for here in range(outside):
        for k in range(4):
            if not 0 <= neighbors[here, k] < here:
                count += 1
    facets = np.empty((count, 3), dtype=np.int64)
    behind = np.empty(count, dtype=np.int64)
    ahead = np.empty(count, dtype=np.int64)
    place = np.empty(count, dtype=np.int64)
    f = 0
    for here in range(outside):
        for k in range(4):
            there = neighbors[here, k]
            if 0 <= there < here:
                continue
            for j in range(3):
                facets[f, j] = simplices[here, _OUTWARD[k, j]]
            behind[f], place[f] = here, k
            ahead[f] = there if there >= 0 else outside
            f += 1
    return facets, behind, ahead, place


@compiled
def _sorted_by(key: Integers, order: Integers, bound: int) -> Integers:
    """Sort rows by a key below a bound; equal ones keep their order."""
    start = np.zeros(bound + 1, dtype=np.int64)
    for row in order:
        start[key[row] + 1] += 1
    for i in range(bound):
        start[i + 1] += start[i]
    after = np.empty_like(order)
    for row in order:
        after[start[key[row]]] = row
        start[key[row]] += 1
    return after


@compiled
def rings(
    facets: Integers, behind: Integers, ahead: Integers, outside: int, n: int
) -> tuple[Integers, Integers, Integers, Integers, Integers, Integers]:
    """Sides of each edge's polygon, counterclockwise; from the ray, if there is one.

    Counterclockwise about an edge that runs along its facet's turn, the line leads
    ahead; about the opposite edge it leads back.

    Returns
    -------
    edges : (E, 2) integer array
    begin : (E + 1,) integer array
        Where the sides of an edge begin.
    side_facet, side_edge, entering, leaving : (S,) integer array
    """
    count = 3 * len(facets)
    low = np.empty(count, dtype=np.int64)
    high = np.empty(count, dtype=np.int64)
    for side in range(count):
        a, b = facets[side // 3, side % 3], facets[side // 3, (side + 1) % 3]
        low[side], high[side] = min(a, b), max(a, b)
    order = _sorted_by(low, _sorted_by(high, np.arange(count), n), n)

    side_facet = np.empty(count, dtype=np.int64)
    side_edge = np.empty(count, dtype=np.int64)
    entering = np.empty(count, dtype=np.int64)
    leaving = np.empty(count, dtype=np.int64)
    begin = np.empty(count + 1, dtype=np.int64)
    number = 0
    for s in range(count):
        side = order[s]
        f = side // 3
        if s == 0 or low[side] != low[order[s - 1]] or high[side] != high[order[s - 1]]:
            begin[number] = s
            number += 1
        along = facets[f, side % 3] == low[side]
        side_facet[s], side_edge[s] = f, number - 1
        entering[s] = behind[f] if along else ahead[f]
        leaving[s] = ahead[f] if along else behind[f]
    begin[number] = count
    edges = np.empty((number, 2), dtype=np.int64)
    for e in range(number):
        edges[e, 0], edges[e, 1] = low[order[begin[e]]], high[order[begin[e]]]
        at = entering[begin[e]]
        for s in range(begin[e], begin[e + 1]):
            if entering[s] == outside:
                at = outside
        for s in range(begin[e], begin[e + 1]):
            q = s
            while entering[q] != at:
                q += 1
            at = leaving[q]
            side_facet[s], side_facet[q] = side_facet[q], side_facet[s]
            entering[s], entering[q] = entering[q], entering[s]
            leaving[s], leaving[q] = leaving[q], leaving[s]
    return edges, begin[: number + 1].copy(), side_facet, side_edge, entering, leaving


@compiled
def _ratio(a: float, a_rest: float, b: float, b_rest: float) -> tuple[float, float]:
    """Return a / b as a float, and what that float rounds off."""
    value = a / b
    back, lost = product(value, b)
    rest = ((((a - back) - lost) + a_rest) - value * b_rest) / b
    total = value + rest
    return total, rest - (total - value)


@compiled
def spheres(
    sites: Sites,
    simplices: Integers,
    neighbors: Integers,
    behind: Integers,
    ahead: Integers,
    place: Integers,
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Corners and lines.

    Returns
    -------
    corner, corner_rest : (T, 3) array
        Circumcenter seen from the first site: float, and what it rounds off.
    normal, normal_rest : (F, 3) array
        Unit vector along the line: floats, and what these round off.
    area : (F,) array
        Twice the facet's area.
    length : (F,) array
        Length of the line; infinite on the hull.
    """
    outside, count = len(simplices), len(behind)
    corner, corner_rest = np.empty((outside, 3)), np.empty((outside, 3))
    volume = np.empty(outside)
    normal, normal_rest = np.empty((count, 3)), np.empty((count, 3))
    area, length = np.empty(count), np.empty(count)
    R = np.empty(SCRATCH, dtype=np.int64)
    after = 0
    for here in range(outside):
        a, b = simplices[here, 0], simplices[here, 1]
        c, d = simplices[here, 2], simplices[here, 3]
        grain, far = sites.grain[a], 0.0
        for i in (b, c, d):
            grain, far = min(grain, sites.grain[i]), max(far, reach(sites, a, i))
        first = after
        while after < count and behind[after] == here:
            if ahead[after] < outside:
                apex = _apex(simplices, neighbors, here, ahead[after])
                grain = min(grain, sites.grain[apex])
                far = max(far, reach(sites, a, apex))
            after += 1
        step, n = lattice(grain, far)
        for k in range(3):
            load(sites, R, 3 * k, a, (b, c, d)[k], step, n)
        compute(R, VOLUME, SPHERE, n)
        under, under_rest = value_of(R, DETERMINANT, step, n)
        volume[here] = under
        for k in range(3):
            over, over_rest = value_of(R, CENTER + k, step, n)
            high, rest = _ratio(over, over_rest, 2 * under, 2 * under_rest)
            corner[here, k], corner_rest[here, k] = high, rest
        for f in range(after - 1, first - 1, -1):  # place 0 last: it overwrites UV
            row, sign = UV, 1.0
            if place[f] > 0:
                row, sign = (VW, WU, UV)[place[f] - 1], -1.0
            else:
                for k in range(2):
                    load(sites, R, 3 * k, b, (c, d)[k], step, n)
                compute(R, NORMAL, NORMAL, n)
            square = 0.0
            for k in range(3):
                normal[f, k], normal_rest[f, k] = value_of(R, row + k, step, n)
                square += normal[f, k] * normal[f, k]
            area[f] = sqrt(square)
            for k in range(3):
                normal[f, k], normal_rest[f, k] = _ratio(
                    sign * normal[f, k], sign * normal_rest[f, k], area[f], 0.0
                )
            length[f] = np.inf
            if ahead[f] < outside:
                apex = _apex(simplices, neighbors, here, ahead[f])
                load(sites, R, T, a, apex, step, n)
                compute(R, TO_SPHERE, TO_SPHERE, n)
                length[f] = value_of(R, POWER, step, n)[0] / (2 * under) * area[f]
    for f in range(count):
        if ahead[f] < outside:
            length[f] = length[f] / volume[ahead[f]]
    return corner, corner_rest, normal, normal_rest, area, length


@compiled
def _apex(simplices: Integers, neighbors: Integers, here: int, there: int) -> int:
    """Site of a tetrahedron that its neighbor lacks."""
    for k in range(3):
        if neighbors[there, k] == here:
            return simplices[there, k]
    return simplices[there, 3]


@compiled
def sines(
    sites: Sites,
    facets: Integers,
    area: Floats,
    edges: Integers,
    begin: Integers,
    side_facet: Integers,
) -> tuple[Integers, Integers, Floats, Integers]:
    """Pairs of sides of one polygon, and the sines of the angles between them.

    With the edge a, and x, y from its first site to the third sites of two facets, the
    angle between the lines is that between a x x and a x y, and its sine is

        a . (x x y) |a| / (|a x x| |a x y|)

    Returns
    -------
    first, second : (P,) integer array
    sine : (P,) array
    pairs : (E,) integer array
        Where the pairs of an edge begin.
    """
    pairs = np.empty(len(edges), dtype=np.int64)
    count = 0
    for e in range(len(edges)):
        pairs[e] = count
        count += (begin[e + 1] - begin[e]) * (begin[e + 1] - begin[e] - 1) // 2
    first = np.empty(count, dtype=np.int64)
    second = np.empty(count, dtype=np.int64)
    sine = np.empty(count)
    largest = 0
    for e in range(len(edges)):
        largest = max(largest, begin[e + 1] - begin[e])
    third = np.empty(largest, dtype=np.int64)
    R = np.empty((_SEEN + 3 * largest, SCRATCH[1]), dtype=np.int64)
    p = 0
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        start, size = begin[e], begin[e + 1] - begin[e]
        grain = min(sites.grain[i], sites.grain[j])
        far = reach(sites, i, j)
        along = 0.0
        for k in range(3):
            along += (sites.x[j, k] - sites.x[i, k]) ** 2
        along = sqrt(along)
        for s in range(size):
            f = side_facet[start + s]
            third[s] = facets[f, 0] + facets[f, 1] + facets[f, 2] - i - j
            grain = min(grain, sites.grain[third[s]])
            far = max(far, reach(sites, i, third[s]))
        step, n = lattice(grain, far)
        for s in range(-1, size):
            row, site = (_SEEN + 3 * s, third[s]) if s >= 0 else (U, j)
            load(sites, R, row, i, site, step, n)
        for s in range(size - 1):
            for k in range(3):
                for m in range(n):
                    R[V + k, m] = R[_SEEN + 3 * s + k, m]
            compute(R, NORMAL, NORMAL, n)
            for t in range(s + 1, size):
                turn(R, _SEEN + 3 * t, n)
                high, _ = value_of(R, DETERMINANT, step, n)
                f, g = side_facet[start + s], side_facet[start + t]
                sine[p] = high / area[f] / area[g] * along
                first[p], second[p] = start + s, start + t
                p += 1
    return first, second, sine, pairs
