"""Where a point is to the facets of a convex hull: exactly, also where almost on one.

A plane is packed as its unit normal, what that rounds off, and a point in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.diagram import DEPTH, HULL, LINES, PLANE
from ikns._kernels.twofold import Triple, difference, twofold_dot

__all__ = ["CANCELED", "depth_behind", "hull_depths"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Where a product of floats is below this part of its terms, it is formed again with
#: twice the digits; above, rounding costs at most 1e-16 / 1e-3.
CANCELED = 1e-3


@compiled
def depth_behind(numbers: Floats, plane: int, x: Triple, rest: Triple) -> float:
    """How far a point, twofold, lies behind the plane packed at a place."""
    depth = (
        numbers[plane] * (numbers[plane + 6] - x[0])
        + numbers[plane + 1] * (numbers[plane + 7] - x[1])
        + numbers[plane + 2] * (numbers[plane + 8] - x[2])
    )
    if abs(depth) < CANCELED:
        depth = _exact_depth(numbers, plane, x, rest)
    return depth


@compiled
def _exact_depth(numbers: Floats, plane: int, x: Triple, rest: Triple) -> float:
    p, p_rest = difference(numbers[plane + 6], x[0])
    q, q_rest = difference(numbers[plane + 7], x[1])
    r, r_rest = difference(numbers[plane + 8], x[2])
    return twofold_dot(
        (numbers[plane], numbers[plane + 1], numbers[plane + 2]),
        (numbers[plane + 3], numbers[plane + 4], numbers[plane + 5]),
        (p, q, r),
        (p_rest - rest[0], q_rest - rest[1], r_rest - rest[2]),
    )


@compiled
def hull_depths(
    numbers: Floats, indices: Indices, x: Triple, rest: Triple, work: Floats
) -> tuple[float, float]:
    """Write how far a point lies behind each facet of the hull.

    Its planes end with one over the depth of the middle.

    Returns
    -------
    depth : float
        The least; positive inside.
    part : float
        The least part of the way from a facet to the middle of the sites.
    """
    least, part = np.inf, np.inf
    depths = indices[DEPTH]
    plane = indices[PLANE] + 10 * (indices[LINES] - indices[HULL])
    for h in range(indices[HULL]):
        depth = depth_behind(numbers, plane + 10 * h, x, rest)
        work[depths + h] = depth
        least = min(least, depth)
        part = min(part, depth * numbers[plane + 10 * h + 9])
    return least, part
