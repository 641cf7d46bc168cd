"""What a query takes from a Voronoi diagram: the corners nearer to it than to any site.

A corner is the center of the sphere through a tetrahedron's sites. Its power is its
squared radius less its squared distance to the query: positive inside the sphere, where
the query takes it. The tetrahedra of these corners, the cavity, hang together. In a
small set all are tried. In a large one a walk toward the query, through facets with the
query beyond them, meets one of them, and the others are its neighbors (A. Bowyer,
Computing Dirichlet tessellations, 1981; D. F. Watson, 1981). The walk ends, because a
Delaunay triangulation has no cycles seen from anywhere (H. Edelsbrunner, 1990).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.diagram import (
    CORNER,
    CORNER_EDGES,
    CORNER_LINES,
    CORNERS,
    DEPTH,
    EDGE_ROWS,
    EDGES,
    HULL,
    KEPT,
    LENGTH,
    LINE_ENDS,
    LINES,
    LISTS,
    PLANE,
    POWER,
    SITES,
    UNKNOWN,
)
from ikns._kernels.hull import CANCELED, depth_behind
from ikns._kernels.twofold import Triple, difference, twofold_dot

__all__ = ["all_powers", "cavity", "forget_cavity", "keep_line"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Keeps a share of nothing, 0 / 0, at nothing; powers are zero or more than 1e-40.
_NOTHING = 1e-300


@compiled
def _power(numbers: Floats, corner: int, x: Triple, rest: Triple) -> float:
    """Power of a query, twofold, to the corner packed at a place."""
    p = x[0] - numbers[corner + 6]
    q = x[1] - numbers[corner + 7]
    r = x[2] - numbers[corner + 8]
    power = (
        (2 * numbers[corner] - p) * p
        + (2 * numbers[corner + 1] - q) * q
        + (2 * numbers[corner + 2] - r) * r
    )
    if abs(power) < CANCELED * numbers[corner + 9]:
        power = _exact_power(numbers, corner, x, rest)
    return power


@compiled
def _exact_power(numbers: Floats, corner: int, x: Triple, rest: Triple) -> float:
    p, p_rest = difference(x[0], numbers[corner + 6])
    q, q_rest = difference(x[1], numbers[corner + 7])
    r, r_rest = difference(x[2], numbers[corner + 8])
    p_rest, q_rest, r_rest = p_rest + rest[0], q_rest + rest[1], r_rest + rest[2]
    u, u_rest = difference(2 * numbers[corner], p)
    v, v_rest = difference(2 * numbers[corner + 1], q)
    w, w_rest = difference(2 * numbers[corner + 2], r)
    return twofold_dot(
        (u, v, w),
        (
            u_rest + 2 * numbers[corner + 3] - p_rest,
            v_rest + 2 * numbers[corner + 4] - q_rest,
            w_rest + 2 * numbers[corner + 5] - r_rest,
        ),
        (p, q, r),
        (p_rest, q_rest, r_rest),
    )


@compiled
def keep_line(numbers: Floats, indices: Indices, line: int, work: Floats) -> None:
    """Write the length of a line on the query's side, from the powers of its ends.

    The power falls linearly along the line. On a line to infinity it falls by twice
    the query's depth behind the hull's facet for each unit of length.
    """
    ends, power = indices[LINE_ENDS] + 2 * line, indices[POWER]
    behind = work[power + indices[ends]]
    hull = line - (indices[LINES] - indices[HULL])
    if hull >= 0:
        kept = max(behind, 0.0) / (2 * work[indices[DEPTH] + hull])
    else:
        ahead = work[power + indices[ends + 1]]
        kept = numbers[indices[LENGTH] + line] * (
            (max(behind, 0.0) + max(ahead, 0.0)) / (abs(behind) + abs(ahead) + _NOTHING)
        )
    work[indices[KEPT] + line] = kept


@compiled
def all_powers(
    numbers: Floats, indices: Indices, x: Triple, rest: Triple, work: Floats
) -> None:
    """Write the powers of all corners, and what is kept of all lines."""
    corner, power = indices[CORNER], indices[POWER]
    for t in range(indices[CORNERS]):
        work[power + t] = _power(numbers, corner + 10 * t, x, rest)
    for line in range(indices[LINES]):
        keep_line(numbers, indices, line, work)


@compiled
def _met(
    numbers: Floats, indices: Indices, x: Triple, rest: Triple, start: int
) -> tuple[int, float]:
    """Walk to a corner that the query takes; also its power. -1 where none is met."""
    t = start
    corner, lines = indices[CORNER], indices[CORNER_LINES]
    ends, planes = indices[LINE_ENDS], indices[PLANE]
    for _ in range(indices[CORNERS]):
        power = _power(numbers, corner + 10 * t, x, rest)
        if power > 0:
            return t, power
        onward = -1
        for k in range(4):
            line = indices[lines + 4 * t + k]
            behind, ahead = indices[ends + 2 * line], indices[ends + 2 * line + 1]
            depth = depth_behind(numbers, planes + 10 * line, x, rest)
            if behind == t and depth < 0 and ahead < indices[CORNERS]:
                onward = ahead
                break
            if ahead == t and depth > 0:
                onward = behind
                break
        if onward < 0:
            break
        t = onward
    return -1, 0.0


@compiled
def cavity(
    numbers: Floats,
    indices: Indices,
    x: Triple,
    rest: Triple,
    start: int,
    work: Floats,
) -> tuple[int, int, int]:
    """Write the powers of the cavity and around it, and what is kept of its lines.

    Returns
    -------
    corners, edges, sites : int
        How many there are in the lists: after three numbers, `SITES` places for sites,
        `EDGES` for edges whose polygons are cut, `CORNERS` for the cavity. No corners
        when the walk failed.
    """
    n, e = indices[SITES], indices[EDGES]
    lists = work[indices[LISTS] :].view(np.int64)
    sites, edges, found = 3, 3 + n, 3 + n + e
    site_marks = found + indices[CORNERS]
    edge_marks = site_marks + n
    power, corner = indices[POWER], indices[CORNER]
    t, height = _met(numbers, indices, x, rest, start)
    if t < 0:
        return 0, 0, 0
    work[power + t] = height
    lists[found] = t
    count, reached = 1, 0
    while reached < count:
        t = lists[found + reached]
        reached += 1
        for k in range(4):
            ends = indices[LINE_ENDS] + 2 * indices[indices[CORNER_LINES] + 4 * t + k]
            other = indices[ends] + indices[ends + 1] - t
            if other < indices[CORNERS] and work[power + other] == UNKNOWN:
                height = _power(numbers, corner + 10 * other, x, rest)
                work[power + other] = height
                if height > 0:
                    lists[found + count] = other
                    count += 1
    edge_count, site_count = 0, 0
    for c in range(count):
        t = lists[found + c]
        for k in range(4):
            keep_line(
                numbers, indices, indices[indices[CORNER_LINES] + 4 * t + k], work
            )
        for k in range(6):
            edge = indices[indices[CORNER_EDGES] + 6 * t + k]
            if lists[edge_marks + edge] == 0:
                lists[edge_marks + edge] = 1
                lists[edges + edge_count] = edge
                edge_count += 1
                for end in range(2):
                    site = indices[indices[EDGE_ROWS] + 5 * edge + end]
                    if lists[site_marks + site] == 0:
                        lists[site_marks + site] = 1
                        lists[sites + site_count] = site
                        site_count += 1
    return count, edge_count, site_count


@compiled
def forget_cavity(
    indices: Indices, corners: int, edges: int, sites: int, work: Floats
) -> None:
    """Leave the scratch memory as it was found."""
    n, e = indices[SITES], indices[EDGES]
    lists = work[indices[LISTS] :].view(np.int64)
    found = 3 + n + e
    site_marks = found + indices[CORNERS]
    edge_marks = site_marks + n
    for c in range(corners):
        t = lists[found + c]
        work[indices[POWER] + t] = UNKNOWN
        for k in range(4):
            line = indices[indices[CORNER_LINES] + 4 * t + k]
            work[indices[KEPT] + line] = 0.0
            for end in range(2):
                other = indices[indices[LINE_ENDS] + 2 * line + end]
                work[indices[POWER] + other] = UNKNOWN
    for c in range(edges):
        lists[edge_marks + lists[3 + n + c]] = 0
    for c in range(sites):
        lists[site_marks + lists[3 + c]] = 0
