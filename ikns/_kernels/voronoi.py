"""The Voronoi diagram of a triangulation, every number as exact as a float can be.

With the edges u, v, w of a tetrahedron and six times its volume, d = u . (v x w), its
circumcenter is

    c = (|u|^2 v x w + |v|^2 w x u + |w|^2 u x v) / (2 d)

seen from its first site. Across a facet with normal n (|n| is twice its area), from the
tetrahedron with d_1 to that with d_2, the Voronoi edge has the length

    L = p d_1 |n| / (2 d_1 d_2)

where p is the power, to the first sphere, of the site that the second tetrahedron adds:
the two powers differ by 2 L times the height above the facet, and that site's is
d_2 / |n|. All of n, d, 2 d c and p d are determinants of the sites. They are formed
without rounding (`exact`) wherever twice a float's digits might not do: what nearly
cancels keeps its digits, and ties are 0.
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
    VOLUME,
    VW,
    Sites,
    determinants,
    value_of,
)
from ikns._kernels.twofold import Triple, difference, product, twofold_dot

__all__ = ["corners", "lengths", "normals", "sines"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Where a sum known to 2**-97 of the size of its terms is below this part of that, it
#: is formed again without rounding; above, it is off by less than 2**-57 of itself.
_CANCELED = 2.0**-40


@compiled
def corners(sites: Sites, simplices: Integers) -> tuple[Floats, Floats, Floats]:
    """Circumcenters and sizes of tetrahedra.

    Returns
    -------
    corner, corner_rest : (T, 3) array
        Seen from the first site: float, and what it rounds off.
    volume : (T,) array
        Six times the volume.
    """
    count = len(simplices)
    corner, corner_rest = np.empty((count, 3)), np.empty((count, 3))
    volume = np.empty(count)
    R = np.empty(SCRATCH, dtype=np.int64)
    for t in range(count):
        a, b, c, d = simplices[t, 0], simplices[t, 1], simplices[t, 2], simplices[t, 3]
        step, n = determinants(sites, R, a, b, c, d, d, SPHERE)
        volume[t], rest = value_of(R, DETERMINANT, step, n)
        for k in range(3):
            above, above_rest = value_of(R, CENTER + k, step, n)
            corner[t, k], corner_rest[t, k] = _ratio(
                above, above_rest, 2 * volume[t], 2 * rest
            )
    return corner, corner_rest, volume


@compiled
def normals(sites: Sites, facets: Integers) -> tuple[Floats, Floats, Floats]:
    """Directions of lines and sizes of facets.

    Returns
    -------
    normal, normal_rest : (F, 3) array
        Unit vector to the side from where a facet's sites turn left: floats, and what
        these round off. Its direction has twice a float's digits, its length one's.
    area : (F,) array
        Twice the facet's area.
    """
    count = len(facets)
    normal, normal_rest = np.empty((count, 3)), np.empty((count, 3))
    area = np.empty(count)
    R = np.empty(SCRATCH, dtype=np.int64)
    for f in range(count):
        a, b, c = facets[f, 0], facets[f, 1], facets[f, 2]
        step, n = determinants(sites, R, a, a, b, c, a, NORMAL)
        square = 0.0
        for k in range(3):
            normal[f, k], normal_rest[f, k] = value_of(R, VW + k, step, n)
            square += normal[f, k] * normal[f, k]
        area[f] = sqrt(square)
        for k in range(3):
            normal[f, k], normal_rest[f, k] = _ratio(
                normal[f, k], normal_rest[f, k], area[f], 0.0
            )
    return normal, normal_rest, area


@compiled
def lengths(
    sites: Sites,
    simplices: Integers,
    neighbors: Integers,
    behind: Integers,
    ahead: Integers,
    corner: Floats,
    corner_rest: Floats,
    volume: Floats,
    area: Floats,
) -> Floats:
    """Lengths of lines, (F,); infinite on the hull."""
    length = np.empty(len(behind))
    R = np.empty(SCRATCH, dtype=np.int64)
    for f in range(len(behind)):
        here, there = behind[f], ahead[f]
        if there == len(simplices):
            length[f] = np.inf
            continue
        a, b = simplices[here, 0], simplices[here, 1]
        c, d = simplices[here, 2], simplices[here, 3]
        e = simplices[there, 0]
        for k in range(1, 4):
            if neighbors[there, k] == here:
                e = simplices[there, k]
        power, scale = _power(sites.x, corner[here], corner_rest[here], a, e)
        if abs(power) < _CANCELED * scale:
            step, n = determinants(sites, R, a, b, c, d, e, TO_SPHERE)
            power = value_of(R, POWER, step, n)[0] / volume[here]
        length[f] = power / 2 * area[f] / volume[there]
    return length


@compiled
def _ratio(a: float, a_rest: float, b: float, b_rest: float) -> tuple[float, float]:
    """Return a / b as a float, and what that float rounds off."""
    value = a / b
    back, lost = product(value, b)
    rest = ((((a - back) - lost) + a_rest) - value * b_rest) / b
    total = value + rest
    return total, rest - (total - value)


@compiled
def _power(x: Floats, c: Floats, c_rest: Floats, a: int, e: int) -> tuple[float, float]:
    """Power of site e to the sphere through site a about a + c, and its terms' size."""
    p, p_rest = _apart(x, a, e)
    reach_0, lost_0 = difference(p[0], 2 * c[0])
    reach_1, lost_1 = difference(p[1], 2 * c[1])
    reach_2, lost_2 = difference(p[2], 2 * c[2])
    reach = (reach_0, reach_1, reach_2)
    rest = (
        lost_0 + p_rest[0] - 2 * c_rest[0],
        lost_1 + p_rest[1] - 2 * c_rest[1],
        lost_2 + p_rest[2] - 2 * c_rest[2],
    )
    scale = 0.0
    for k in range(3):
        scale += (abs(p[k]) + abs(2 * c[k])) * abs(p[k])
    return twofold_dot(reach, rest, p, p_rest), scale


@compiled
def _apart(x: Floats, a: int, b: int) -> tuple[Triple, Triple]:
    """Vector from site a to site b, and what that rounds off."""
    u, u_rest = difference(x[b, 0], x[a, 0])
    v, v_rest = difference(x[b, 1], x[a, 1])
    w, w_rest = difference(x[b, 2], x[a, 2])
    return (u, v, w), (u_rest, v_rest, w_rest)


@compiled
def sines(
    sites: Sites,
    facets: Integers,
    behind: Integers,
    normal: Floats,
    normal_rest: Floats,
    area: Floats,
    edges: Integers,
    begin: Integers,
    side_facet: Integers,
    entering: Integers,
) -> tuple[Integers, Integers, Floats, Integers]:
    """Pairs of sides of one polygon, and the sines of the angles between them.

    Lines are at as much of an angle as the facets at the edge a. With a facet's normal
    n, unit vector, and y from the edge's first site to the other facet's third, that is
    how high y is over the facet, for its distance from the edge:

        n . y |a| / |a x y|

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
    R = np.empty(SCRATCH, dtype=np.int64)
    p = 0
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        axis, _ = _apart(sites.x, i, j)
        along = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
        for s in range(begin[e], begin[e + 1]):
            f = side_facet[s]
            sign = 1.0 if entering[s] == behind[f] else -1.0
            n = (sign * normal[f, 0], sign * normal[f, 1], sign * normal[f, 2])
            n_rest = (
                sign * normal_rest[f, 0],
                sign * normal_rest[f, 1],
                sign * normal_rest[f, 2],
            )
            for t in range(s + 1, begin[e + 1]):
                g = side_facet[t]
                third = facets[g, 0] + facets[g, 1] + facets[g, 2] - i - j
                y, y_rest = _apart(sites.x, i, third)
                height = twofold_dot(n, n_rest, y, y_rest)
                if abs(height) < _CANCELED * (abs(y[0]) + abs(y[1]) + abs(y[2])):
                    other = facets[f, 0] + facets[f, 1] + facets[f, 2] - i - j
                    step, m = determinants(sites, R, i, j, other, third, i, VOLUME)
                    height = value_of(R, DETERMINANT, step, m)[0] / area[f]
                first[p], second[p], sine[p] = s, t, height / area[g] * along
                p += 1
    return first, second, sine, pairs
