"""Sines of the angles between the sides of Voronoi faces.

A side is normal to a facet around the edge, so the angle between two sides is that
between their facets. With the edge a, a facet's unit normal n, and y from the edge's
first site to the other facet's third, the sine is the height of y over the facet by its
distance from the edge:

    sine = n . y |a| / |a x y|
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.double_double import difference, double_double_dot
from ikns.arrays import Array, Indices


@compiled
def sines(
    x: Array,
    facets: Indices,
    behind: Indices,
    normal: Array,
    normal_rest: Array,
    area: Array,
    edges: Indices,
    begin: Indices,
    side_facet: Indices,
    entering: Indices,
    canceled: float,
    first: Indices,
    second: Indices,
    sine: Array,
) -> None:
    """Write the pairs of sides of each face, edge by edge, and their sines.

    A height below the part `canceled` of |y|_1 is left out: the sine is NaN. Of facets
    (F, 3), seen from where their normals point, the sites turn left; `area` (F,) is
    twice theirs, and the sides of edge e begin at ``begin[e]``. The rest is as in a
    Voronoi diagram.
    """
    p = 0
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        along = 0.0
        for k in range(3):
            along += (x[j, k] - x[i, k]) ** 2
        along = sqrt(along)
        for s in range(begin[e], begin[e + 1]):
            f = side_facet[s]
            sign = 1.0 if entering[s] == behind[f] else -1.0
            n = (normal[f, 0], normal[f, 1], normal[f, 2])
            n_rest = (normal_rest[f, 0], normal_rest[f, 1], normal_rest[f, 2])
            for t in range(s + 1, begin[e + 1]):
                g = side_facet[t]
                third = facets[g, 0] + facets[g, 1] + facets[g, 2] - i - j
                u, u_rest = difference(x[third, 0], x[i, 0])
                v, v_rest = difference(x[third, 1], x[i, 1])
                w, w_rest = difference(x[third, 2], x[i, 2])
                height = double_double_dot(
                    n, n_rest, (u, v, w), (u_rest, v_rest, w_rest)
                )
                if abs(height) < canceled * (abs(u) + abs(v) + abs(w)):
                    height = np.nan
                first[p], second[p] = s, t
                sine[p] = sign * height / area[g] * along
                p += 1
