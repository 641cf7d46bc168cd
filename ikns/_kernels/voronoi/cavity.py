"""The cavity of a query: the tetrahedra whose circumspheres hold it (Bowyer-Watson).

The power of a circumsphere is its squared radius less the squared distance of query and
circumcenter: positive where the query is inside. These tetrahedra are connected. A
visibility walk toward the query, through facets with the query beyond them, meets one
of them, and the others are found from neighbor to neighbor (A. Bowyer, Computing
Dirichlet tessellations, 1981; D. F. Watson, Computing the n-dimensional Delaunay
tessellation, 1981). The walk ends because a Delaunay triangulation, seen from anywhere,
has no cycles (H. Edelsbrunner, An acyclicity theorem for cell complexes in d
dimensions, 1990).

The circumcenters of the cavity are the vertices of the Voronoi diagram that lie in the
query's cell. "Kept" of a Voronoi edge is the part in that cell.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled, inner
from ikns._kernels.voronoi.diagram import (
    CAVITY,
    CIRCUMCENTER,
    DEPTH,
    FACET_ENDS,
    FACETS,
    HULL,
    KEPT,
    LENGTH,
    MARK,
    NEIGHBORS,
    PLANE,
    POWER,
    SITES,
    START,
    TETRAHEDRA,
    TETRAHEDRON,
    UNKNOWN,
    place,
)
from ikns._kernels.voronoi.double_double import Triple, difference, double_double_dot
from ikns._kernels.voronoi.hull import CANCELED, depth_behind, exact_depth
from ikns.arrays import Array, Indices

#: Keeps a share of nothing, 0 / 0, at nothing; powers are zero or more than 1e-40.
_NOTHING = 1e-300


@inner
def power_to(numbers: Array, center: int, x: Triple) -> float:
    """Power of the circumsphere packed at a place."""
    at = place(center)
    p = x[0] - numbers[at + place(6)]
    q = x[1] - numbers[at + place(7)]
    r = x[2] - numbers[at + place(8)]
    return (
        (2 * numbers[at] - p) * p
        + (2 * numbers[at + place(1)] - q) * q
        + (2 * numbers[at + place(2)] - r) * r
    )


@compiled
def _exact_power(numbers: Array, center: int, x: Triple, rest: Triple) -> float:
    """Power for a double-double query, to 1e-30 of its terms."""
    c = numbers[center : center + 9]
    p, p_rest = difference(x[0], c[6])
    q, q_rest = difference(x[1], c[7])
    r, r_rest = difference(x[2], c[8])
    p_rest, q_rest, r_rest = p_rest + rest[0], q_rest + rest[1], r_rest + rest[2]
    u, u_rest = difference(2 * c[0], p)
    v, v_rest = difference(2 * c[1], q)
    w, w_rest = difference(2 * c[2], r)
    return double_double_dot(
        (u, v, w),
        (
            u_rest + 2 * c[3] - p_rest,
            v_rest + 2 * c[4] - q_rest,
            w_rest + 2 * c[5] - r_rest,
        ),
        (p, q, r),
        (p_rest, q_rest, r_rest),
    )


@inner
def kept_length(length: float, behind: float, ahead: float) -> float:
    """Kept length of a Voronoi edge, from the powers of its ends.

    The power changes linearly along it: all, behind / (behind - ahead) of it, or none.
    """
    return length * (
        (max(behind, 0.0) + max(ahead, 0.0)) / (abs(behind) + abs(ahead) + _NOTHING)
    )


@inner
def check_all_spheres(
    numbers: Array, indices: Indices, x: Triple, rest: Triple, work: Array
) -> tuple[int, int]:
    """Write the powers of all tetrahedra and the kept lengths of all facets.

    Returns how many are listed: tetrahedra of the cavity, and all sites.
    """
    centers, powers = indices[CIRCUMCENTER], indices[POWER]
    unsure = False
    for t in range(indices[TETRAHEDRA]):
        power = power_to(numbers, centers + 10 * t, x)
        work[place(powers + t)] = power
        unsure |= abs(power) < numbers[place(centers + 10 * t + 9)]
    if unsure:
        for t in range(indices[TETRAHEDRA]):
            if abs(work[place(powers + t)]) < numbers[place(centers + 10 * t + 9)]:
                power = _exact_power(numbers, centers + 10 * t, x, rest)
                work[place(powers + t)] = power
    lists = work[indices[START] :].view(np.int64)
    cavity = indices[CAVITY] - indices[START]
    neighbors = indices[NEIGHBORS] - indices[START]
    count = 0
    for t in range(indices[TETRAHEDRA]):
        lists[place(cavity + count)] = t
        count += work[place(powers + t)] > 0
    for i in range(indices[SITES]):
        lists[place(neighbors + i)] = i
    kept, depths, lengths = indices[KEPT], indices[DEPTH], indices[LENGTH]
    ends, hull = indices[FACET_ENDS], indices[FACETS] - indices[HULL]
    for facet in range(hull):
        behind = work[place(powers + indices[place(ends + 2 * facet)])]
        ahead = work[place(powers + indices[place(ends + 2 * facet + 1)])]
        length = numbers[place(lengths + facet)]
        work[place(kept + facet)] = kept_length(length, behind, ahead)
    for facet in range(hull, indices[FACETS]):
        behind = work[place(powers + indices[place(ends + 2 * facet)])]
        depth = work[place(depths + facet - hull)]
        work[place(kept + facet)] = max(behind, 0.0) / (2 * depth)
    return count, indices[SITES]


@compiled
def _walk(
    numbers: Array, indices: Indices, x: Triple, rest: Triple, start: int
) -> tuple[int, float]:
    """Walk to a tetrahedron of the cavity; also its power. -1 where the walk fails."""
    rows, centers, planes = indices[TETRAHEDRON], indices[CIRCUMCENTER], indices[PLANE]
    infinity, ends, t = indices[TETRAHEDRA], indices[FACET_ENDS], start
    for _ in range(infinity):
        center = centers + 10 * t
        power = power_to(numbers, center, x)
        if abs(power) < numbers[place(center + 9)]:
            power = _exact_power(numbers, center, x, rest)
        if power > 0:
            return t, power
        onward = infinity
        for k in range(4):
            facet = indices[place(rows + 30 * t + k)]
            depth = depth_behind(numbers, planes + 10 * facet, x)
            if abs(depth) < CANCELED:
                depth = exact_depth(numbers, planes + 10 * facet, x, rest)
            beyond = depth < 0 if indices[place(ends + 2 * facet)] == t else depth > 0
            if beyond:
                onward = indices[place(rows + 30 * t + 4 + k)]
                break
        if onward == infinity:
            break
        t = onward
    return -1, 0.0


@inner
def find_cavity(
    numbers: Array, indices: Indices, x: Triple, rest: Triple, start: int, work: Array
) -> tuple[int, int]:
    """Write the powers in and around the cavity, and the kept lengths of its facets.

    Returns how many tetrahedra and sites are listed; none when the walk failed.
    """
    t, height = _walk(numbers, indices, x, rest, start)
    if t < 0:
        return 0, 0
    infinity, hull = indices[TETRAHEDRA], indices[FACETS] - indices[HULL]
    powers, kept, depths = indices[POWER], indices[KEPT], indices[DEPTH]
    rows, lengths = indices[TETRAHEDRON], indices[LENGTH]
    centers = indices[CIRCUMCENTER]
    lists = work[indices[START] :].view(np.int64)
    cavity = indices[CAVITY] - indices[START]
    neighbors = indices[NEIGHBORS] - indices[START]
    mark = indices[MARK] - indices[START]
    work[place(powers + t)] = height
    lists[0] = lists[place(cavity)] = t
    count, sites, reached = 1, 0, 0
    while reached < count:
        t = lists[place(cavity + reached)]
        mine, row = work[place(powers + t)], rows + 30 * t
        reached += 1
        for k in range(4):
            facet, other = indices[place(row + k)], indices[place(row + 4 + k)]
            if other == infinity:
                # The power falls by twice the query's depth for each unit of length.
                depth = work[place(depths + facet - hull)]
                work[place(kept + facet)] = mine / (2 * depth)
                continue
            height = work[place(powers + other)]
            if height == UNKNOWN:
                center = centers + 10 * other
                height = power_to(numbers, center, x)
                if abs(height) < numbers[place(center + 9)]:
                    height = _exact_power(numbers, center, x, rest)
                work[place(powers + other)] = height
                if height > 0:
                    lists[place(cavity + count)] = other
                    count += 1
            length = numbers[place(lengths + facet)]
            work[place(kept + facet)] = kept_length(length, mine, height)
        for k in range(8, 12):
            site = indices[place(row + k)]
            if lists[place(mark + site)] == 0:
                lists[place(mark + site)] = 1
                lists[place(neighbors + sites)] = site
                sites += 1
    return count, sites


@inner
def clear_cavity(indices: Indices, tetrahedra: int, sites: int, work: Array) -> None:
    """Leave the scratch memory as it was found."""
    rows, powers = indices[TETRAHEDRON], indices[POWER]
    lists = work[indices[START] :].view(np.int64)
    cavity = indices[CAVITY] - indices[START]
    neighbors = indices[NEIGHBORS] - indices[START]
    mark = indices[MARK] - indices[START]
    for c in range(tetrahedra):
        t = lists[place(cavity + c)]
        work[place(powers + t)] = UNKNOWN
        for k in range(4, 8):
            other = indices[place(rows + 30 * t + k)]
            work[place(powers + other)] = UNKNOWN
    for c in range(sites):
        lists[place(mark + lists[place(neighbors + c)])] = 0
