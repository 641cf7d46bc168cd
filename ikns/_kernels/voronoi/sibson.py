"""Natural-neighbor coordinates from the Voronoi faces that a query's cell cuts.

Sites i and j that are neighbors share a Voronoi face, normal to the unit vector
axis_ij. Let A_ij be twice its area in the query's cell and p = site - query. The part
that the query takes of cell i is bounded by these faces and by one in the bisector of
query and site i. So its volume V_i and that face's area F_i are (divergence theorem)

    V_i = sum_j A_ij (axis_ij . p_j) / 12
    F_i = -sum_j A_ij (axis_ij . p_i) / (2 |p_i|)

Sibson's coordinates are V_i over their sum (R. Sibson, A vector identity for the
Dirichlet tessellation, 1980), Laplace's are F_i / |p_i| over theirs (V. V. Belikov et
al., The non-Sibsonian interpolation, 1997; K. Sugihara, Surface interpolation based on
new local coordinates, 1999). Twice the area is

    A = sum_{k < l} length_k length_l sin(angle from side k to side l)

over the kept parts of the sides in their order, from where the cut enters the face.
Positions do not appear, only lengths and angles, each accurate to its last digit.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import inner
from ikns._kernels.voronoi.diagram import (
    ANGLE,
    CAVITY,
    EDGE,
    KEPT,
    LAPLACE,
    METHOD,
    OFFSET,
    POWER,
    RING,
    TETRAHEDRON,
    VOLUME,
    place,
)
from ikns.arrays import Array, Indices


@inner
def add_faces(numbers: Array, indices: Indices, tetrahedra: int, work: Array) -> None:
    """Add up V, or F times 12 |p|, of the sites around a cavity of so many tetrahedra.

    The tetrahedra of a cavity around an edge follow each other. So each edge is met
    once at the first of them, or at its first tetrahedron where all are in the cavity.
    One long loop, because calls that pass arrays cost as much as a face.
    """
    offset, volume, power = indices[OFFSET], indices[VOLUME], indices[POWER]
    kept, lengths, rows = indices[KEPT], indices[RING], indices[TETRAHEDRON]
    edges, angles = indices[EDGE], indices[ANGLE]
    cavity = work[indices[CAVITY] :].view(np.int64)
    laplace = indices[METHOD] == LAPLACE
    for c in range(tetrahedra):
        row = rows + 30 * cavity[place(c)]
        for k_edge in range(12, 30, 3):
            slot = place(row + k_edge)
            edge, start = place(edges + indices[slot]), indices[slot + place(1)]
            sides = indices[edge + place(2)]
            whole = work[place(power + indices[slot + place(2)])] > 0
            if whole and start < sides - 1:
                continue
            ring = edge + place(4)
            k, n = start, 0
            while n < sides:
                facet = indices[ring + place(k)]
                work[place(lengths + n)] = work[place(kept + facet)]
                k, n = k + 1 if k < sides - 1 else 0, n + 1
                if not work[place(power + indices[ring + place(sides + k)])] > 0:
                    break
            if whole and n < sides:
                continue

            angle = place(angles + indices[edge + place(3)])
            sine = angle + place(3 + start * (sides - 1))
            area = work[place(lengths)] * work[place(lengths + 1)] * numbers[sine]
            if n > 2:
                area, k = 0.0, start
                for m in range(n - 1):
                    across, sine = 0.0, angle + place(2 + k * (sides - 1))
                    for gap in range(1, n - m):
                        across += (
                            work[place(lengths + m + gap)] * numbers[sine + place(gap)]
                        )
                    area += work[place(lengths + m)] * across
                    k = k + 1 if k < sides - 1 else 0

            i, j = indices[edge], indices[edge + place(1)]
            to_i, to_j = place(offset + 3 * i), place(offset + 3 * j)
            u, v, w = (
                numbers[angle],
                numbers[angle + place(1)],
                numbers[angle + place(2)],
            )
            along_i = (
                u * work[to_i] + v * work[to_i + place(1)] + w * work[to_i + place(2)]
            )
            along_j = (
                u * work[to_j] + v * work[to_j + place(1)] + w * work[to_j + place(2)]
            )
            if laplace:
                along_i, along_j = -along_j, -along_i
            work[place(volume + i)] += area * along_j
            work[place(volume + j)] -= area * along_i
