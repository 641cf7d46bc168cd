"""The point of a convex hull that is nearest to a query.

All sites lie behind the plane through the nearest point y that is normal to x - y.
Comparing distances alone would give y only to 1e-8, because they are stationary there;
so distances choose a few candidates and the sites choose y. Candidates are the feet of
x on the facets' planes, where they are in the facet, and on their edges.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled, inner
from ikns._kernels.voronoi.diagram import HULL, HULL_SITES, SITE, place
from ikns._kernels.voronoi.double_double import Triple
from ikns.arrays import Array, Indices

#: Distances that differ by less are compared by where the sites lie.
_TIE = 1e-12


@compiled
def _site(numbers: Array, indices: Indices, facet: int, k: int) -> Triple:
    at = indices[SITE] + 3 * indices[place(indices[HULL_SITES] + 3 * facet + k)]
    return numbers[place(at)], numbers[place(at + 1)], numbers[place(at + 2)]


@compiled
def _minus(a: Triple, b: Triple) -> Triple:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _cross(a: Triple, b: Triple) -> Triple:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@compiled
def _along(a: Triple, s: float, u: Triple, t: float, v: Triple) -> Triple:
    return (
        a[0] + s * u[0] + t * v[0],
        a[1] + s * u[1] + t * v[1],
        a[2] + s * u[2] + t * v[2],
    )


@compiled
def _candidate(
    numbers: Array, indices: Indices, facet: int, kind: int, x: Triple
) -> Triple:
    """Foot of x on a facet's plane (kind 3) or on one of its edges (0, 1, 2)."""
    if kind < 3:
        a = _site(numbers, indices, facet, kind)
        u = _minus(_site(numbers, indices, facet, (kind + 1) % 3), a)
        t = _dot(u, _minus(x, a)) / _dot(u, u)
        return _along(a, min(max(t, 0.0), 1.0), u, 0.0, u)
    a = _site(numbers, indices, facet, 0)
    u = _minus(_site(numbers, indices, facet, 1), a)
    v = _minus(_site(numbers, indices, facet, 2), a)
    w = _minus(x, a)
    normal = _cross(u, v)
    square = _dot(normal, normal)  # 0 for facets flat to rounding: s, t are no numbers
    s = _dot(_cross(v, normal), w) / square
    t = _dot(_cross(normal, u), w) / square
    if s >= 0 and t >= 0 and s + t <= 1:
        return _along(a, s, u, t, v)
    return a


@inner
def nearest_on_hull(numbers: Array, indices: Indices, x: Triple) -> Triple:
    """Project a query outside the hull onto it."""
    least = np.inf
    for facet in range(indices[HULL]):
        for kind in range(4):
            away = _minus(x, _candidate(numbers, indices, facet, kind, x))
            least = min(least, _dot(away, away))
    best, ahead = x, np.inf
    for facet in range(indices[HULL]):
        for kind in range(4):
            y = _candidate(numbers, indices, facet, kind, x)
            away = _minus(x, y)
            if _dot(away, away) <= least * (1 + _TIE):
                farthest = -np.inf
                for other in range(indices[HULL]):
                    for k in range(3):
                        site = _site(numbers, indices, other, k)
                        farthest = max(farthest, _dot(away, _minus(site, y)))
                if farthest < ahead:
                    best, ahead = y, farthest
    return best
