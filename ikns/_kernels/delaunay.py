"""Delaunay triangulation in space, one site after another, however degenerate.

A new site takes the place of all tetrahedra whose spheres hold it. They leave a cavity,
and each facet of it becomes the base of a tetrahedron with the site as its apex
(A. Bowyer and D. F. Watson, The Computer Journal 24, 1981). A vertex at infinity stands
on every facet of the hull, so that outside is nothing special. Predicates are exact and
never tie: cavities are star-shaped and no tetrahedron is flat.

A cell is a row of eight integers: four vertices of positive orientation, infinity (-1)
only in place 0, and four links across the facets that leave out each vertex,
4 * (cell there) + (place there of the vertex left out).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled
from ikns._kernels.exact import SCRATCH, Sites
from ikns._kernels.predicates import in_sphere, orientation

__all__ = ["OUTWARD", "triangulate"]

Integers = NDArray[np.int64]

_INFINITY = -1
_FREE = -2  # in place 0 of a row that holds no cell
#: Vertices of a facet in turn, seen from outside.
OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
# Columns of notes: when a cell was last seen (in the cavity: 2 step, beside it: one
# more); list of the cavity's cells; list of free rows.
_SEEN, _CAVITY, _SPARE = 0, 1, 2


@compiled
def triangulate(sites: Sites, order: Integers) -> tuple[Integers, Integers]:
    """Triangulate sites.

    Parameters
    ----------
    sites : Sites
    order : (N,) integer array
        In which to insert them, the first three not on one line.

    Returns
    -------
    simplices : (T, 4) integer array
        Tetrahedra of positive volume: seen from the last, the others turn left. None at
        all if the sites lie in one plane or two of them in one place.
    neighbors : (T, 4) integer array
        The tetrahedron across the facet that leaves out each vertex; -1 on the hull.
    """
    R = np.empty(SCRATCH, dtype=np.int64)
    room = 8 * len(order) + 64  # random sites need 7 times their number
    cells = np.empty((room, 8), dtype=np.int64)
    notes = np.zeros((room, 3), dtype=np.int64)
    used = _first_cells(sites, R, order, cells)
    start = (cells[0, 0], cells[0, 1], cells[0, 2], cells[0, 3])
    last = spare = np.int64(0)
    for step in range(1, len(order) + 1):
        site = order[step - 1]
        if used == 0 or site in start:
            continue
        last = _locate(sites, R, cells, last, site)
        if _coincident(sites, cells, last, site):
            used = np.int64(0)
            continue
        size, rim = _find_cavity(sites, R, cells, notes, last, site, 2 * step)
        while used + rim > room:
            cells, notes = _doubled(cells), _doubled(notes)
            room *= 2
        used, spare, last = _fill(cells, notes, size, used, spare, site, 2 * step)
    return _finite(cells, notes, used)


@compiled
def _doubled(table: Integers) -> Integers:
    larger = np.zeros((2 * table.shape[0], table.shape[1]), dtype=np.int64)
    for i in range(table.shape[0]):
        for k in range(table.shape[1]):
            larger[i, k] = table[i, k]
    return larger


@compiled
def _place(cells: Integers, cell: int, vertex: int) -> int:
    """Where a vertex is in its cell."""
    for k in range(3):
        if cells[cell, k] == vertex:
            return k
    return 3


@compiled
def _first_cells(sites: Sites, R: Integers, order: Integers, cells: Integers) -> int:
    """One tetrahedron and the four infinite ones around it; the number of cells."""
    a, b, c, d = order[0], order[1], order[2], order[3]
    volume = 0
    for i in range(3, len(order)):
        if volume == 0:
            d = order[i]
            volume = orientation(sites, R, a, b, c, d)
    if volume == 0:
        return 0
    cells[0, 0], cells[0, 3] = a, d
    cells[0, 1], cells[0, 2] = (b, c) if volume > 0 else (c, b)
    for k in range(4):
        i, j, m = OUTWARD[k]
        cells[k + 1, 0] = _INFINITY
        cells[k + 1, 1] = cells[0, i]
        cells[k + 1, 2] = cells[0, m]
        cells[k + 1, 3] = cells[0, j]
    for p in range(5):  # each leaves out one of the five vertices
        for q in range(5):
            if p != q:
                i = _place(cells, p, cells[0, q - 1] if q > 0 else _INFINITY)
                j = _place(cells, q, cells[0, p - 1] if p > 0 else _INFINITY)
                cells[p, 4 + i] = 4 * q + j
    return 5


@compiled
def _locate(sites: Sites, R: Integers, cells: Integers, cell: int, site: int) -> int:
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
def _coincident(sites: Sites, cells: Integers, cell: int, site: int) -> bool:
    """Whether a site is in the place of one of a cell's vertices."""
    for k in range(4):
        vertex = cells[cell, k]
        if (
            vertex >= 0
            and sites.x[vertex, 0] == sites.x[site, 0]
            and sites.x[vertex, 1] == sites.x[site, 1]
            and sites.x[vertex, 2] == sites.x[site, 2]
        ):
            return True
    return False


@compiled
def _holds(sites: Sites, R: Integers, cells: Integers, cell: int, site: int) -> bool:
    """Whether the sphere of a cell holds a site."""
    if cells[cell, 0] == _INFINITY:
        side = orientation(
            sites, R, site, cells[cell, 1], cells[cell, 2], cells[cell, 3]
        )
        if side != 0:
            return side > 0
        cell = cells[cell, 4] >> 2  # cuts the plane of the facet in the same circle
    return in_sphere(
        sites, R, cells[cell, 0], cells[cell, 1], cells[cell, 2], cells[cell, 3], site
    )


@compiled
def _find_cavity(
    sites: Sites,
    R: Integers,
    cells: Integers,
    notes: Integers,
    cell: int,
    site: int,
    mark: int,
) -> tuple[int, int]:
    """List the cells whose spheres hold a site; their number and that of the facets."""
    notes[cell, _SEEN] = mark
    notes[0, _CAVITY] = cell
    size, rim, i = 1, 0, 0
    while i < size:
        for k in range(4):
            other = cells[notes[i, _CAVITY], 4 + k] >> 2
            if notes[other, _SEEN] < mark:
                if _holds(sites, R, cells, other, site):
                    notes[other, _SEEN] = mark
                    notes[size, _CAVITY] = other
                    size += 1
                else:
                    notes[other, _SEEN] = mark + 1
            rim += notes[other, _SEEN] - mark
        i += 1
    return size, rim


@compiled
def _fill(
    cells: Integers,
    notes: Integers,
    size: int,
    used: int,
    spare: int,
    site: int,
    mark: int,
) -> tuple[int, int, int]:
    """Fill the cavity with cells around the site; rows used, free rows, a finite cell.

    Meanwhile a cavity's link to the outside is ~(new cell on that facet).
    """
    last = -1
    for i in range(size):
        cell = notes[i, _CAVITY]
        for k in range(4):
            link = cells[cell, 4 + k]
            if notes[link >> 2, _SEEN] == mark:
                continue
            if spare > 0:
                spare -= 1
                new = notes[spare, _SPARE]
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
            notes[new, _SEEN] = 0
            if cells[new, 0] >= 0:
                last = new
    for i in range(size):
        for k in range(4):
            cell = notes[i, _CAVITY]
            new = ~cells[cell, 4 + k]
            for j in range(4):
                if new >= 0 and cells[new, 4 + j] < 0:
                    other, m = _around_edge(cells, cell, k, j)
                    cells[new, 4 + j] = 4 * other + m
                    cells[other, 4 + m] = 4 * new + j
    for i in range(size):
        cells[notes[i, _CAVITY], 0] = _FREE
        notes[spare, _SPARE] = notes[i, _CAVITY]
        spare += 1
    return used, spare, last


@compiled
def _around_edge(cells: Integers, cell: int, k: int, j: int) -> tuple[int, int]:
    """Turn about a cell's edge without k and j, through the cavity, from facet k on.

    Returns the new cell on the facet where this ends, and the place in that cell of the
    vertex that is neither the site nor on the edge.
    """
    place, ahead = k, j
    while cells[cell, 4 + ahead] >= 0:
        left = cells[cell, place]
        link = cells[cell, 4 + ahead]
        cell, place = link >> 2, link & 3
        ahead = _place(cells, cell, left)
    return ~cells[cell, 4 + ahead], place


@compiled
def _finite(cells: Integers, notes: Integers, used: int) -> tuple[Integers, Integers]:
    """Return the finite cells, numbered anew."""
    count = 0
    for cell in range(used):
        notes[cell, _SEEN] = -1
        if cells[cell, 0] >= 0:
            notes[cell, _SEEN] = count
            count += 1
    simplices = np.empty((count, 4), dtype=np.int64)
    neighbors = np.empty((count, 4), dtype=np.int64)
    for cell in range(used):
        row = notes[cell, _SEEN]
        if row >= 0:
            for k in range(4):
                simplices[row, k] = cells[cell, k]
                neighbors[row, k] = notes[cells[cell, 4 + k] >> 2, _SEEN]
    return simplices, neighbors
