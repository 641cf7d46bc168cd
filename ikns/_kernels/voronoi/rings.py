"""The facets of a triangulation, and the rings of facets around its edges.

The Voronoi face of an edge has the Voronoi edges of these facets as its sides.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.delaunay import OUTWARD
from ikns.arrays import Indices


def list_facets(
    simplices: Indices, neighbors: Indices
) -> tuple[Indices, Indices, Indices]:
    """Every facet once, turned away from the tetrahedron behind it.

    Returns their sites (F, 3), counterclockwise from ahead, and the tetrahedra behind
    and ahead, (F,); T outside the hull.
    """
    outside = len(simplices)
    ahead = np.where(neighbors < 0, outside, neighbors)
    owned = ahead > np.arange(outside)[:, None]
    behind, place = map(np.ascontiguousarray, np.nonzero(owned))
    facets = simplices[behind[:, None], OUTWARD[place]]
    return facets, behind, ahead[owned]


def list_sides(
    facets: Indices, behind: Indices, ahead: Indices, outside: int
) -> tuple[Indices, Indices, Indices, Indices, Indices, Indices]:
    """Sides of each edge's face, counterclockwise; from the ray, if there is one.

    Counterclockwise about an edge in the direction of the facet's turn, its Voronoi
    edge leads ahead; about the opposite edge it leads back.

    Returns edges (E, 2), where the sides of each begin (E + 1,), and of the S sides the
    facet, the edge, and the tetrahedra entering and leaving, (S,).
    """
    a, b = facets.ravel(), np.roll(facets, -1, axis=1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort([high, low])
    low, high, along = low[order], high[order], a[order] == low[order]
    new = np.append(True, (np.diff(low) != 0) | (np.diff(high) != 0))
    begin = np.append(np.flatnonzero(new), len(new))
    side_facet, side_edge = order // 3, new.cumsum() - 1
    entering = np.where(along, behind[side_facet], ahead[side_facet])
    leaving = np.where(along, ahead[side_facet], behind[side_facet])
    sort_sides(begin, outside, side_facet, entering, leaving)
    edges = np.column_stack([low, high])[new]
    return edges, begin, side_facet, side_edge, entering, leaving


@compiled
def sort_sides(
    begin: Indices,
    outside: int,
    side_facet: Indices,
    entering: Indices,
    leaving: Indices,
) -> None:
    """Sort the sides of each face: each starts where the last one ends."""
    for e in range(len(begin) - 1):
        at = entering[begin[e]]
        for s in range(begin[e], begin[e + 1]):
            if entering[s] == outside:
                at = outside
        for s in range(begin[e], begin[e + 1]):
            q = s
            while entering[q] != at:
                q += 1
            at = leaving[q]
            side_facet[s], side_facet[q] = side_facet[q], side_facet[s]
            entering[s], entering[q] = entering[q], entering[s]
            leaving[s], leaving[q] = leaving[q], leaving[s]
