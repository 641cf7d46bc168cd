"""Which lines of the Voronoi diagram are sides of which polygon, and in which order.

A line is at a right angle to a facet of the Delaunay triangulation; the polygon that
two cells share is at a right angle to the edge between their sites, and its sides are
the lines of all facets around that edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.delaunay import OUTWARD

__all__ = ["lines", "rings"]

Integers = NDArray[np.int64]


def lines(
    simplices: Integers, neighbors: Integers
) -> tuple[Integers, Integers, Integers]:
    """Every facet once, turned away from the tetrahedron behind it.

    Returns
    -------
    facets : (F, 3) integer array
        Their sites, counterclockwise from ahead.
    behind, ahead : (F,) integer array
        Tetrahedra on the two sides; T outside the hull.
    """
    outside = len(simplices)
    ahead = np.where(neighbors < 0, outside, neighbors)
    owned = ahead > np.arange(outside)[:, None]
    behind, place = map(np.ascontiguousarray, np.nonzero(owned))
    facets = simplices[behind[:, None], OUTWARD[place]]
    return facets, behind, ahead[owned]


def rings(
    facets: Integers, behind: Integers, ahead: Integers, outside: int
) -> tuple[Integers, Integers, Integers, Integers, Integers, Integers]:
    """Sides of each edge's polygon, counterclockwise; from the ray, if there is one.

    Counterclockwise about an edge that runs along its facet's turn, the line leads
    ahead; about the opposite edge it leads back.

    Returns
    -------
    edges : (E, 2) integer array
    begin : (E + 1,) integer array
        Where the sides of an edge begin.
    side_facet, side_edge, entering, leaving : (S,) integer array
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
    in_turn(begin, outside, side_facet, entering, leaving)
    edges = np.column_stack([low, high])[new]
    return edges, begin, side_facet, side_edge, entering, leaving


@compiled
def in_turn(
    begin: Integers,
    outside: int,
    side_facet: Integers,
    entering: Integers,
    leaving: Integers,
) -> None:
    """Put the sides of each polygon in turn: each starts where the last one ends."""
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
