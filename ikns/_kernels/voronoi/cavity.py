"""What a query takes from a Voronoi diagram: the corners nearer to it than to any site.

A corner is the center of the sphere through a tetrahedron's sites. Its power is its
squared radius less its squared distance to the query: positive inside the sphere, where
the query takes it. The tetrahedra of these corners, the cavity, hang together. A walk
toward the query, through facets with the query beyond them, meets one of them, and the
others are its neighbors (A. Bowyer, Computing Dirichlet tessellations, 1981; D. F.
Watson, Computing the n-dimensional Delaunay tessellation, 1981). The walk ends because
a Delaunay triangulation, seen from anywhere, has no cycles (H. Edelsbrunner, An
acyclicity theorem for cell complexes in d dimensions, 1990).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.diagram import (
    CORNER,
    CORNER_ROWS,
    CORNERS,
    DEPTH,
    FOUND,
    HULL,
    KEPT,
    LENGTH,
    LINE_ENDS,
    LINES,
    MARK,
    NEAR,
    PLANE,
    POWER,
    SITES,
    START,
    UNKNOWN,
    place,
)
from ikns._kernels.voronoi.double_double import Triple, difference, double_double_dot
from ikns._kernels.voronoi.hull import CANCELED, depth_behind, exact_depth

__all__ = ["find_cavity", "forget_cavity", "kept_length", "power_to", "try_all"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Keeps a share of nothing, 0 / 0, at nothing; powers are zero or more than 1e-40.
_NOTHING = 1e-300


@compiled
def power_to(numbers: Floats, corner: int, x: Triple) -> float:
    """Power of a query to the corner packed at a place."""
    at = place(corner)
    p = x[0] - numbers[at + place(6)]
    q = x[1] - numbers[at + place(7)]
    r = x[2] - numbers[at + place(8)]
    return (
        (2 * numbers[at] - p) * p
        + (2 * numbers[at + place(1)] - q) * q
        + (2 * numbers[at + place(2)] - r) * r
    )


@compiled
def _exact_power(numbers: Floats, corner: int, x: Triple, rest: Triple) -> float:
    """Power of a query in double-double arithmetic, to 1e-30 of its terms."""
    c = numbers[corner : corner + 9]
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


@compiled
def kept_length(length: float, behind: float, ahead: float) -> float:
    """Length of a line on the query's side, from the powers of its ends.

    The power falls linearly along the line: 1, behind / (behind - ahead), or 0.
    """
    return length * (
        (max(behind, 0.0) + max(ahead, 0.0)) / (abs(behind) + abs(ahead) + _NOTHING)
    )


@compiled
def try_all(
    numbers: Floats, indices: Indices, x: Triple, rest: Triple, work: Floats
) -> tuple[int, int]:
    """Write the powers of all corners and what is kept of all lines.

    Returns
    -------
    corners, sites : int
        How many are listed: the corners that are taken, and all sites.
    """
    corners, powers = indices[CORNER], indices[POWER]
    unsure = False
    for t in range(indices[CORNERS]):
        power = power_to(numbers, corners + 10 * t, x)
        work[place(powers + t)] = power
        unsure |= abs(power) < numbers[place(corners + 10 * t + 9)]
    if unsure:
        for t in range(indices[CORNERS]):
            if abs(work[place(powers + t)]) < numbers[place(corners + 10 * t + 9)]:
                power = _exact_power(numbers, corners + 10 * t, x, rest)
                work[place(powers + t)] = power
    lists = work[indices[START] :].view(np.int64)
    found, near = indices[FOUND] - indices[START], indices[NEAR] - indices[START]
    count = 0
    for t in range(indices[CORNERS]):
        lists[place(found + count)] = t
        count += work[place(powers + t)] > 0
    for i in range(indices[SITES]):
        lists[place(near + i)] = i
    kept, depths, lengths = indices[KEPT], indices[DEPTH], indices[LENGTH]
    ends, hull = indices[LINE_ENDS], indices[LINES] - indices[HULL]
    for line in range(hull):
        behind = work[place(powers + indices[place(ends + 2 * line)])]
        ahead = work[place(powers + indices[place(ends + 2 * line + 1)])]
        length = numbers[place(lengths + line)]
        work[place(kept + line)] = kept_length(length, behind, ahead)
    for line in range(hull, indices[LINES]):
        behind = work[place(powers + indices[place(ends + 2 * line)])]
        depth = work[place(depths + line - hull)]
        work[place(kept + line)] = max(behind, 0.0) / (2 * depth)
    return count, indices[SITES]


@compiled
def _meet(
    numbers: Floats, indices: Indices, x: Triple, rest: Triple, start: int
) -> tuple[int, float]:
    """Walk to a corner that the query takes; also its power. -1 where none is met."""
    rows, corners, planes = indices[CORNER_ROWS], indices[CORNER], indices[PLANE]
    infinity, ends, t = indices[CORNERS], indices[LINE_ENDS], start
    for _ in range(infinity):
        corner = corners + 10 * t
        power = power_to(numbers, corner, x)
        if abs(power) < numbers[place(corner + 9)]:
            power = _exact_power(numbers, corner, x, rest)
        if power > 0:
            return t, power
        onward = infinity
        for k in range(4):
            line = indices[place(rows + 30 * t + k)]
            depth = depth_behind(numbers, planes + 10 * line, x)
            if abs(depth) < CANCELED:
                depth = exact_depth(numbers, planes + 10 * line, x, rest)
            beyond = depth < 0 if indices[place(ends + 2 * line)] == t else depth > 0
            if beyond:
                onward = indices[place(rows + 30 * t + 4 + k)]
                break
        if onward == infinity:
            break
        t = onward
    return -1, 0.0


@compiled
def find_cavity(
    numbers: Floats,
    indices: Indices,
    x: Triple,
    rest: Triple,
    start: int,
    work: Floats,
) -> tuple[int, int]:
    """Write the powers of the cavity and around it, and what is kept of its lines.

    Returns
    -------
    corners, sites : int
        How many are listed; no corners when the walk failed.
    """
    t, height = _meet(numbers, indices, x, rest, start)
    if t < 0:
        return 0, 0
    infinity, hull = indices[CORNERS], indices[LINES] - indices[HULL]
    powers, kept, depths = indices[POWER], indices[KEPT], indices[DEPTH]
    rows, corners, lengths = indices[CORNER_ROWS], indices[CORNER], indices[LENGTH]
    lists = work[indices[START] :].view(np.int64)
    found, near = indices[FOUND] - indices[START], indices[NEAR] - indices[START]
    mark = indices[MARK] - indices[START]
    work[place(powers + t)] = height
    lists[0] = lists[place(found)] = t
    count, sites, reached = 1, 0, 0
    while reached < count:
        t = lists[place(found + reached)]
        mine, row = work[place(powers + t)], rows + 30 * t
        reached += 1
        for k in range(4):
            line, other = indices[place(row + k)], indices[place(row + 4 + k)]
            if other == infinity:
                # The power falls by twice the query's depth for each unit of length.
                depth = work[place(depths + line - hull)]
                work[place(kept + line)] = mine / (2 * depth)
                continue
            height = work[place(powers + other)]
            if height == UNKNOWN:
                corner = corners + 10 * other
                height = power_to(numbers, corner, x)
                if abs(height) < numbers[place(corner + 9)]:
                    height = _exact_power(numbers, corner, x, rest)
                work[place(powers + other)] = height
                if height > 0:
                    lists[place(found + count)] = other
                    count += 1
            length = numbers[place(lengths + line)]
            work[place(kept + line)] = kept_length(length, mine, height)
        for k in range(8, 12):
            site = indices[place(row + k)]
            if lists[place(mark + site)] == 0:
                lists[place(mark + site)] = 1
                lists[place(near + sites)] = site
                sites += 1
    return count, sites


@compiled
def forget_cavity(indices: Indices, corners: int, sites: int, work: Floats) -> None:
    """Leave the scratch memory as it was found."""
    rows, powers = indices[CORNER_ROWS], indices[POWER]
    lists = work[indices[START] :].view(np.int64)
    found, near = indices[FOUND] - indices[START], indices[NEAR] - indices[START]
    mark = indices[MARK] - indices[START]
    for c in range(corners):
        t = lists[place(found + c)]
        work[place(powers + t)] = UNKNOWN
        for k in range(4, 8):
            other = indices[place(rows + 30 * t + k)]
            work[place(powers + other)] = UNKNOWN
    for c in range(sites):
        lists[place(mark + lists[place(near + c)])] = 0
