"""Depths of points behind the facets of a convex hull, exact also close to a facet.

A plane is packed as its unit normal, what that rounds off, and a point in it.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled, inner
from ikns._kernels.voronoi.diagram import (
    CENTER,
    DEPTH,
    FACETS,
    HULL,
    PLANE,
    ROUNDING,
    SCALE,
    place,
)
from ikns._kernels.voronoi.double_double import Triple, difference, double_double_dot
from ikns.arrays import Array, Indices, Mask

#: Where a product of floats is below this part of its terms, it is formed again with
#: twice the digits; above, rounding costs at most 1e-16 / 1e-3.
CANCELED = 1e-3
#: Queries farther out are brought this near: only their direction matters there.
_FAR = 1e9


@inner
def depth_behind(numbers: Array, plane: int, x: Triple) -> float:
    """How far a point lies behind the plane packed at a place."""
    at = place(plane)
    return (
        numbers[at] * (numbers[at + place(6)] - x[0])
        + numbers[at + place(1)] * (numbers[at + place(7)] - x[1])
        + numbers[at + place(2)] * (numbers[at + place(8)] - x[2])
    )


@inner
def exact_depth(numbers: Array, plane: int, x: Triple, rest: Triple) -> float:
    """How far a double-double point lies behind a plane, to 1e-30."""
    n = numbers[plane : plane + 9]
    p, p_rest = difference(n[6], x[0])
    q, q_rest = difference(n[7], x[1])
    r, r_rest = difference(n[8], x[2])
    return double_double_dot(
        (n[0], n[1], n[2]),
        (n[3], n[4], n[5]),
        (p, q, r),
        (p_rest - rest[0], q_rest - rest[1], r_rest - rest[2]),
    )


@inner
def hull_depths(
    numbers: Array, indices: Indices, x: Triple, rest: Triple, work: Array
) -> tuple[float, float]:
    """Write how far a point lies behind each facet of the hull.

    Its planes end with one over the depth of the middle. Returns the least depth,
    positive inside, and the least part of the way from a facet to the middle of the
    sites, where that may be less than CANCELED.
    """
    depths, facets = indices[DEPTH], indices[HULL]
    planes = indices[PLANE] + 10 * (indices[FACETS] - facets)
    least, part = np.inf, np.inf
    for h in range(facets):
        depth = depth_behind(numbers, planes + 10 * h, x)
        work[place(depths + h)] = depth
        least = min(least, depth)
    if least < CANCELED:
        least = np.inf
        for h in range(facets):
            plane, depth = planes + 10 * h, work[place(depths + h)]
            if abs(depth) < CANCELED:
                depth = exact_depth(numbers, plane, x, rest)
                work[place(depths + h)] = depth
            least = min(least, depth)
            part = min(part, depth * numbers[place(plane + 9)])
    return least, part


@inner
def scaled(numbers: Array, x: Triple) -> Triple:
    """Scale a query, m, and bring it near; NaN where it overflows."""
    scale = numbers[SCALE]
    y = (x[0] * scale, x[1] * scale, x[2] * scale)
    a = y[0] - numbers[CENTER]
    b = y[1] - numbers[CENTER + 1]
    c = y[2] - numbers[CENTER + 2]
    reach = max(abs(a), abs(b), abs(c))
    if reach > _FAR:
        y = (
            numbers[CENTER] + a / reach * _FAR,
            numbers[CENTER + 1] + b / reach * _FAR,
            numbers[CENTER + 2] + c / reach * _FAR,
        )
    return y


@compiled
def inside_many(diagram: Array, x: Array, within: Mask) -> None:
    """Write whether queries (Q, 3), m, are in the hull or, but for rounding, on it."""
    indices, rest = diagram.view(np.int64), (0.0, 0.0, 0.0)
    for q in range(len(x)):
        y = scaled(diagram, (x[q, 0], x[q, 1], x[q, 2]))
        within[q] = np.isfinite(y[0]) and np.isfinite(y[1]) and np.isfinite(y[2])
        if within[q]:
            least, _ = hull_depths(diagram, indices, y, rest, diagram)
            within[q] = least >= -diagram[ROUNDING]
