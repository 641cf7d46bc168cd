"""Delaunay triangulation in space by incremental insertion, exact for any sites.

A new site removes all tetrahedra whose circumspheres hold it. They leave a cavity, and
each facet of its boundary becomes the base of a tetrahedron with the site as its apex
(A. Bowyer and D. F. Watson, The Computer Journal 24, 1981). Facets of the hull are
joined with a vertex at infinity, so that sites outside the hull need no rules of their
own. Predicates are exact and never tie: cavities are star-shaped and no tetrahedron is
flat.

A cell is a row of eight integers: four vertices of positive orientation, infinity (-1)
only in place 0, and four links across the facets that leave out each vertex,
4 * (cell there) + (place there of the vertex left out).
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.exact import SCRATCH, Sites
from ikns._kernels.voronoi.predicates import in_sphere, orientation
from ikns.arrays import Indices

_INFINITY = -1
_FREE = -2  # in place 0 of a row that holds no cell
#: Vertices of a facet in turn, seen from outside.
OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
# Columns of scratch: the mark of the step that last saw a cell, plus one if the cell
# was next to that step's cavity; list of the cavity's cells; list of free rows.
_SEEN, _CAVITY, _FREE_ROWS = 0, 1, 2


def triangulate(sites: Sites, order: Indices) -> tuple[Indices, Indices]:
    """Triangulate different sites, the first three in order not on one line.

    Returns
    -------
    simplices : (T, 4) integer array
        Tetrahedra of positive volume: seen from the last, the others turn left. None at
        all if the sites lie in one plane.
    neighbors : (T, 4) integer array
        The tetrahedron across the facet that leaves out each vertex; -1 on the hull.
    """
    cells = first = _first_cells(sites, order)
    # At first half; random sites need 7 times their number.
    capacity = 4 * len(order) + 32
    used = 0
    while len(first) and not used:
        capacity *= 2
        cells = np.empty((capacity, 8), dtype=np.int64)
        cells[:5] = first
        others = order[~np.isin(order, first[0, :4])]
        used = insert(sites, others, cells, np.zeros((capacity, 3), dtype=np.int64))
    finite = cells[:used, 0] >= 0
    number = np.where(finite, finite.cumsum() - 1, -1)
    cells = cells[:used][finite]
    return cells[:, :4].copy(), number[cells[:, 4:] >> 2].copy()


def _first_cells(sites: Sites, order: Indices) -> Indices:
    """One tetrahedron and the four infinite ones around it, if there are any."""
    R = np.empty(SCRATCH, dtype=np.int64)
    a, b, c = order[:3]
    for d in order[3:]:
        volume = orientation(sites, R, a, b, c, d)
        if volume:
            break
    else:
        return np.empty((0, 8), dtype=np.int64)
    corners = [a, b, c, d] if volume > 0 else [a, c, b, d]
    vertices = [corners]
    for i, j, k in OUTWARD:
        vertices.append([_INFINITY, corners[i], corners[k], corners[j]])
    left_out = [_INFINITY, *corners]  # by each of the five
    links = [
        [
            4 * left_out.index(vertex) + vertices[left_out.index(vertex)].index(missing)
            for vertex in row
        ]
        for row, missing in zip(vertices, left_out, strict=True)
    ]
    return np.hstack([vertices, links])


@compiled
def insert(sites: Sites, order: Indices, cells: Indices, scratch: Indices) -> int:
    """Insert sites one by one; return the rows used, or 0 if there are too few."""
    R = np.empty(SCRATCH, dtype=np.int64)
    used, spare, last = np.int64(5), np.int64(0), np.int64(0)
    for step in range(len(order)):
        site, mark = order[step], 2 * step + 2
        last = _locate(sites, R, cells, last, site)
        size, boundary = _find_cavity(sites, R, cells, scratch, last, site, mark)
        if used + boundary > len(cells):
            return 0
        used, spare, last = _fill_cavity(cells, scratch, size, used, spare, site, mark)
    return int(used)


@compiled
def _locate(sites: Sites, R: Indices, cells: Indices, cell: int, site: int) -> int:
    """Walk from a finite cell to one that holds a site, facet by facet."""
    before = -1
    while cells[cell, 0] != _INFINITY:
        onward = -1
        for k in range(4):
            if onward < 0 and cells[cell, 4 + k] >> 2 != before:
                side = orientation(
                    sites,
                    R,
                    site if k == 0 else cells[cell, 0],
                    site if k == 1 else cells[cell, 1],
                    site if k == 2 else cells[cell, 2],
                    site if k == 3 else cells[cell, 3],
                )
                if side < 0:
                    onward = cells[cell, 4 + k] >> 2
        if onward < 0:
            break
        before, cell = cell, onward
    return cell


@compiled
def _find_cavity(
    sites: Sites,
    R: Indices,
    cells: Indices,
    scratch: Indices,
    cell: int,
    site: int,
    mark: int,
) -> tuple[int, int]:
    """List the cells whose spheres hold a site; return their number and the facets'."""
    scratch[cell, _SEEN] = mark
    scratch[0, _CAVITY] = cell
    size, boundary, i = 1, 0, 0
    while i < size:
        for k in range(4):
            other = cells[scratch[i, _CAVITY], 4 + k] >> 2
            if scratch[other, _SEEN] < mark:
                side, finite = 0, other
                if cells[other, 0] == _INFINITY:
                    v, w = cells[other, 2], cells[other, 3]
                    side = orientation(sites, R, site, cells[other, 1], v, w)
                    finite = cells[other, 4] >> 2  # cuts the facet's plane alike
                if side == 0:
                    u, v = cells[finite, 0], cells[finite, 1]
                    w, z = cells[finite, 2], cells[finite, 3]
                    side = 1 if in_sphere(sites, R, u, v, w, z, site) else -1
                if side > 0:
                    scratch[other, _SEEN] = mark
                    scratch[size, _CAVITY] = other
                    size += 1
                else:
                    scratch[other, _SEEN] = mark + 1
            boundary += scratch[other, _SEEN] - mark
        i += 1
    return size, boundary


@compiled
def _fill_cavity(
    cells: Indices,
    scratch: Indices,
    size: int,
    used: int,
    spare: int,
    site: int,
    mark: int,
) -> tuple[int, int, int]:
    """Fill the cavity with cells at the site; rows used, free rows, a finite cell.

    Meanwhile a cavity's link to the outside is ~(new cell on that facet).
    """
    last = -1
    for i in range(size):
        cell = scratch[i, _CAVITY]
        for k in range(4):
            link = cells[cell, 4 + k]
            if scratch[link >> 2, _SEEN] == mark:
                continue
            if spare > 0:
                spare -= 1
                new = scratch[spare, _FREE_ROWS]
            else:
                new = used
                used += 1
            for j in range(4):
                cells[new, j] = cells[cell, j]
                cells[new, 4 + j] = -1
            cells[new, k] = site
            cells[new, 4 + k] = link
            cells[link >> 2, 4 + (link & 3)] = 4 * new + k
            cells[cell, 4 + k] = ~new
            scratch[new, _SEEN] = 0
            if cells[new, 0] >= 0:
                last = new
    for i in range(size):
        for k in range(4):
            cell = scratch[i, _CAVITY]
            new = ~cells[cell, 4 + k]
            for j in range(4):
                if new >= 0 and cells[new, 4 + j] < 0:
                    other, m = _around_edge(cells, cell, k, j)
                    cells[new, 4 + j] = 4 * other + m
                    cells[other, 4 + m] = 4 * new + j
    for i in range(size):
        cells[scratch[i, _CAVITY], 0] = _FREE
        scratch[spare, _FREE_ROWS] = scratch[i, _CAVITY]
        spare += 1
    return used, spare, last


@compiled
def _around_edge(cells: Indices, cell: int, k: int, j: int) -> tuple[int, int]:
    """Rotate around the edge of a cell opposite to k and j, within the cavity.

    Returns the new cell on the facet where this ends, and the place in that cell of the
    vertex that is neither the site nor on the edge.
    """
    place, ahead = k, j
    while cells[cell, 4 + ahead] >= 0:
        left = cells[cell, place]
        link = cells[cell, 4 + ahead]
        cell, place = link >> 2, link & 3
        ahead = 0
        while cells[cell, ahead] != left:
            ahead += 1
    return ~cells[cell, 4 + ahead], place
