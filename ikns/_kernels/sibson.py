"""Natural-neighbor coordinates from polygons that a query cuts: Sibson's, Laplace's.

Between neighbors i and j stands a polygon of the Voronoi diagram, at a right angle to
the unit vector axis_ij. Let A_ij be twice its area on the query's side and p = site -
query. The part that the query takes of cell i is closed by these polygons and by one in
the bisector of p_i. So its volume V_i and that closing face's area F_i are (Gauss)

    V_i = sum_j A_ij (axis_ij . p_j) / 12
    F_i = -sum_j A_ij (axis_ij . p_i) / (2 |p_i|)

Sibson's coordinates are V_i over their sum (R. Sibson, A vector identity for the
Dirichlet tessellation, 1980), Laplace's are F_i / |p_i| over theirs (V. V. Belikov et
al., The non-Sibsonian interpolation, 1997; K. Sugihara, Surface interpolation based on
new local coordinates, 1999). Twice the area is

    A = sum_{k < l} length_k length_l sin(angle from side k to side l)

over the kept parts of the sides in their order, from where the cut enters the polygon.
Positions do not appear, only lengths and angles, each accurate to its last digit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.diagram import (
    AXIS,
    EDGE_ROWS,
    KEPT,
    LAPLACE,
    METHOD,
    POWER,
    RING,
    SITE,
    TOWARD,
    VOLUME,
)
from ikns._kernels.twofold import Triple

__all__ = ["add_edge", "face_site"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@compiled
def face_site(
    numbers: Floats, indices: Indices, site: int, x: Triple, work: Floats
) -> float:
    """Write the way from the query to a site; return its square."""
    at, toward = indices[SITE] + 3 * site, indices[TOWARD] + 3 * site
    p, q, r = numbers[at] - x[0], numbers[at + 1] - x[1], numbers[at + 2] - x[2]
    work[toward], work[toward + 1], work[toward + 2] = p, q, r
    return p * p + q * q + r * r


@compiled
def _kept_area(numbers: Floats, indices: Indices, row: int, work: Floats) -> float:
    """Twice the area on the query's side of the polygon whose edge is packed there."""
    sides, ring, sines = indices[row + 2], indices[row + 3], indices[row + 4]
    power, kept, lengths = indices[POWER], indices[KEPT], indices[RING]
    corners = ring + 2 * sides
    start, taken = 0, 0
    before = work[power + indices[corners]] > 0
    for k in range(sides):
        after = work[power + indices[corners + k + 1]] > 0
        if after and not before:
            start = k
        taken += after
        before = after
    if taken == 0:
        return 0.0
    for k in range(sides):
        work[lengths + k] = work[kept + indices[ring + start + k]]
    area = 0.0
    for k in range(sides - 1):
        at = start + k
        if at >= sides:
            at -= sides
        at = sines + at * (sides - 1) - 1
        across = 0.0
        for m in range(1, sides - k):
            across += work[lengths + k + m] * numbers[at + m]
        area += work[lengths + k] * across
    return area


@compiled
def add_edge(numbers: Floats, indices: Indices, edge: int, work: Floats) -> None:
    """Add what one polygon contributes to the coordinates of its two sites."""
    row, axis = indices[EDGE_ROWS] + 5 * edge, indices[AXIS] + 3 * edge
    area = _kept_area(numbers, indices, row, work)
    if area == 0:
        return
    i, j = indices[row], indices[row + 1]
    to_i, to_j = indices[TOWARD] + 3 * i, indices[TOWARD] + 3 * j
    along_i = (
        numbers[axis] * work[to_i]
        + numbers[axis + 1] * work[to_i + 1]
        + numbers[axis + 2] * work[to_i + 2]
    )
    along_j = (
        numbers[axis] * work[to_j]
        + numbers[axis + 1] * work[to_j + 1]
        + numbers[axis + 2] * work[to_j + 2]
    )
    if indices[METHOD] == LAPLACE:
        along_i, along_j = along_j, along_i
        area = -area
    work[indices[VOLUME] + i] += area * along_j
    work[indices[VOLUME] + j] -= area * along_i
