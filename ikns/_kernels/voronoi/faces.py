"""Solid angles of Voronoi faces, seen from their sites.

A face is a fan of triangles from the axis through both sites; seen from a site, a
triangle with the unit vectors a, b, c to its vertices has the solid angle

    2 atan2(a . (b x c), 1 + a . b + b . c + c . a)

(A. Van Oosterom and J. Strackee, IEEE Transactions on Biomedical Engineering, 1983).
"""

from __future__ import annotations

from math import atan2, sqrt

import numpy as np

from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices

Vector = tuple[float, float, float]


@compiled
def solid_angles(
    points: Array,
    place: Array,
    normal: Array,
    edges: Indices,
    axis: Array,
    side_facet: Indices,
    side_edge: Indices,
    entering: Indices,
    leaving: Indices,
) -> Array:
    """Solid angles of faces from the first sites of their edges, (E,) steradian.

    Of sites (N, 3) with circumcenters at `place` (T, 3); the rest as in a Voronoi
    diagram.
    """
    angle = np.zeros(len(edges))
    first = (0.0, 0.0, 0.0)
    for s in range(len(side_edge)):
        e, f = side_edge[s], side_facet[s]
        site = edges[e, 0]
        a = (axis[e, 0], axis[e, 1], axis[e, 2])
        start = _toward(points, place, normal, site, entering[s], f)
        end = _toward(points, place, normal, site, leaving[s], f)
        angle[e] += _solid_angle(a, start, end)
        if entering[s] == len(place):
            first = start
        if leaving[s] == len(place):  # back at infinity to the first ray
            angle[e] += _solid_angle(a, end, first)
    return angle


@compiled
def _toward(
    points: Array, place: Array, normal: Array, site: int, center: int, f: int
) -> Vector:
    """Return the unit vector from a site to a circumcenter, or along f's ray."""
    if center == len(place):
        return normal[f, 0], normal[f, 1], normal[f, 2]
    x = place[center, 0] - points[site, 0]
    y = place[center, 1] - points[site, 1]
    z = place[center, 2] - points[site, 2]
    r = sqrt(x * x + y * y + z * z)
    return x / r, y / r, z / r


@compiled
def _solid_angle(a: Vector, b: Vector, c: Vector) -> float:
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    bc = b[0] * c[0] + b[1] * c[1] + b[2] * c[2]
    ca = c[0] * a[0] + c[1] * a[1] + c[2] * a[2]
    return 2 * atan2(volume, 1 + ab + bc + ca)
