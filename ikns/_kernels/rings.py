"""Which lines of the Voronoi diagram are sides of which polygon, and in which order.

A line is at a right angle to a facet of the Delaunay triangulation; the polygon that
two cells share is at a right angle to the edge between their sites, and its sides are
the lines of all facets around that edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.delaunay import OUTWARD

__all__ = ["lines", "rings"]

Integers = NDArray[np.int64]


@compiled
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
    count = 0
    for here in range(outside):
        for k in range(4):
            if not 0 <= neighbors[here, k] < here:
                count += 1
    facets = np.empty((count, 3), dtype=np.int64)
    behind = np.empty(count, dtype=np.int64)
    ahead = np.empty(count, dtype=np.int64)
    f = 0
    for here in range(outside):
        for k in range(4):
            there = neighbors[here, k]
            if 0 <= there < here:
                continue
            for j in range(3):
                facets[f, j] = simplices[here, OUTWARD[k, j]]
            behind[f] = here
            ahead[f] = there if there >= 0 else outside
            f += 1
    return facets, behind, ahead


@compiled
def _sorted_by(key: Integers, order: Integers, bound: int) -> Integers:
    """Sort rows by a key below a bound; equal ones keep their order."""
    start = np.zeros(bound + 1, dtype=np.int64)
    for row in order:
        start[key[row] + 1] += 1
    for i in range(bound):
        start[i + 1] += start[i]
    after = np.empty_like(order)
    for row in order:
        after[start[key[row]]] = row
        start[key[row]] += 1
    return after


@compiled
def rings(
    facets: Integers, behind: Integers, ahead: Integers, outside: int, n: int
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
    count = 3 * len(facets)
    low = np.empty(count, dtype=np.int64)
    high = np.empty(count, dtype=np.int64)
    for side in range(count):
        a, b = facets[side // 3, side % 3], facets[side // 3, (side + 1) % 3]
        low[side], high[side] = min(a, b), max(a, b)
    order = _sorted_by(low, _sorted_by(high, np.arange(count), n), n)

    side_facet = np.empty(count, dtype=np.int64)
    side_edge = np.empty(count, dtype=np.int64)
    entering = np.empty(count, dtype=np.int64)
    leaving = np.empty(count, dtype=np.int64)
    begin = np.empty(count + 1, dtype=np.int64)
    number = 0
    for s in range(count):
        side = order[s]
        f = side // 3
        if s == 0 or low[side] != low[order[s - 1]] or high[side] != high[order[s - 1]]:
            begin[number] = s
            number += 1
        along = facets[f, side % 3] == low[side]
        side_facet[s], side_edge[s] = f, number - 1
        entering[s] = behind[f] if along else ahead[f]
        leaving[s] = ahead[f] if along else behind[f]
    begin[number] = count
    edges = np.empty((number, 2), dtype=np.int64)
    for e in range(number):
        edges[e, 0], edges[e, 1] = low[order[begin[e]]], high[order[begin[e]]]
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
    return edges, begin[: number + 1].copy(), side_facet, side_edge, entering, leaving
