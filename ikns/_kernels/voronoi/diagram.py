"""Where things are in a packed Voronoi diagram and in a query's scratch memory.

Arrays are dear at the border between Python and compiled code: 80 ns each, as much as
five polygons. So a diagram is one array of floats that is also read as integers, bit by
bit: a header, scratch memory, integers and floats. The header has counts, options and
the places where blocks begin; blocks are rows of equal width, but for edges. A copy of
a diagram holds all that a thread needs; or a thread brings other scratch memory.

A line is a Voronoi edge, dual to a facet of a tetrahedron; those of the hull come last.
A polygon's ring holds its lines, then the corners that these start from, once around;
one that is open begins at infinity. Its sines are a row a line: of the angle from that
line to the next, to the one after that, and so on, once around. For each of its six
edges a tetrahedron knows where the edge's integers are, which line of the ring leads to
it, and from which tetrahedron.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["new_work", "place"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# Places are unsigned: numba takes others for negative ones that count from the end,
# and to tell costs as much as what is done there.
place = np.uint64

# The header begins with counts, and the longest ring.
SITES, CORNERS, LINES, HULL, EDGES, LONGEST, VALUES = range(7)
# Options, and the tetrahedron to start from; -1 where all are tried.
METHOD, OUTSIDE, MIDDLE = range(7, 10)
# Floats.
SCALE, CENTER, ROUNDING = 10, 11, 14
# Where blocks of scratch begin.
POWER = 15  # 1 a tetrahedron, and one for infinity: UNKNOWN between queries
KEPT = 16  # 1 a line
DEPTH = 17  # 1 a hull facet
VOLUME = 18  # 1 a site: 0 between queries
TOWARD = 19  # 3 a site
RING = 20  # 1 a line of the longest ring
START = 21  # 1 integer: where the last walk ended
FOUND = 22  # integers: tetrahedra of the cavity
NEAR = 23  # integers: their sites
MARK = 24  # 1 integer a site: 0 between queries
# Where blocks of integers begin, and their rows.
CORNER_ROWS = 25  # 30 a tetrahedron: lines, where these lead, sites, 3 for each edge
LINE_ENDS = 26  # 2 a line: tetrahedra behind and ahead; CORNERS is infinity
HULL_SITES = 27  # 3 a hull facet
EDGE = 28  # 4 + 2 s an edge with s lines: sites i and j, s, floats, ring
# Where blocks of floats begin, and their rows.
SITE = 29  # 3 a site
CORNER = 30  # 10 a tetrahedron: corner, its rest, first site, least sure power
LENGTH = 31  # 1 a line; 0 on the hull
PLANE = 32  # 10 a line: unit normal, its rest, a site; see hull_depths
ANGLE = 33  # 3 + s (s - 1) an edge with s lines: axis, sines
VALUE = 34  # VALUES a site
GRADIENT = 35  # 3 VALUES a site, for SMOOTH only
HEADER = 36

UNKNOWN = -1.0

# Methods.
SIBSON, LAPLACE, SMOOTH = 0, 1, 2
# Rules outside the hull.
NEAREST, PROJECT, NOWHERE = 0, 1, 2
# What became of a query.
OUTSIDE_HULL, INSIDE_HULL, NOT_FINITE, UNSURE = 0, 1, -1, -2


def new_work(indices: Indices) -> Floats:
    """Scratch memory for queries, one for each thread.

    Parameters
    ----------
    indices : integer array
        The packed diagram.
    """
    work = np.zeros(indices[CORNER_ROWS])  # the first block after all scratch
    work[indices[POWER] : indices[KEPT]] = UNKNOWN
    return work
