"""Where things are in a packed Voronoi diagram and in a query's scratch memory.

Arrays are dear at the border between Python and compiled code: about 50 ns each, as
much as twenty tetrahedra. So a diagram is two of them, one of floats and one of
integers, and a query's scratch memory is a third. The integers begin with counts,
options and the places where each block begins; blocks are rows of equal width. The
lines of the hull come last.

A polygon's ring holds its lines twice over, so that it can be read from any start
without turning back, and then the corners between them: line k leads from corner k to
corner k + 1. Its sines are a row a line: of the angle from that line to the next, to
the one after that, and so on, once around.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["new_work"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# Integers: counts. A line is a Voronoi edge, dual to a facet of a tetrahedron.
SITES, CORNERS, LINES, HULL, EDGES, RINGS = range(6)
# Options.
VALUES, METHOD, OUTSIDE, WALK = range(6, 10)
# Where blocks of integers begin, and their rows.
CORNER_LINES = 10  # 4 a tetrahedron
CORNER_EDGES = 11  # 6 a tetrahedron
LINE_ENDS = 12  # 2 a line: tetrahedra behind and ahead; CORNERS is infinity
HULL_SITES = 13  # 3 a hull facet
EDGE_ROWS = 14  # 5 an edge: sites i and j, lines of its ring, where ring, sines begin
RING_LINES = 15  # 3 times an edge's lines and 1
# Where blocks of floats begin, and their rows.
SITE = 16  # 3 a site
CORNER = 17  # 10 a tetrahedron: corner, what it rounds off, first site, size
LENGTH = 18  # 1 a line; 0 on the hull
PLANE = 19  # 10 a line: its unit normal, what it rounds off, a site; see hull_depths
AXIS = 20  # 3 an edge
VALUE = 21  # VALUES a site
SINE = 22  # for an edge with s lines, s rows of s - 1
# Where blocks of scratch begin.
POWER = 23  # 1 a tetrahedron, and one for infinity: UNKNOWN between queries
KEPT = 24  # 1 a line: 0 between queries
DEPTH = 25  # 1 a hull facet
VOLUME = 26  # 1 a site: 0 between queries
TOWARD = 27  # 3 a site
RING = 28  # 1 a line of the longest ring
LISTS = 29  # integers, see cavity; those that are marks are 0 between queries
WORK = 30  # length of all scratch
HEADER = 31

UNKNOWN = -1.0

# The floats begin with these.
SCALE, CENTER, ROUNDING = 0, 1, 4
NUMBERS = 5

# Methods.
SIBSON, LAPLACE = 0, 1
# Rules outside the hull.
NEAREST, PROJECT, NOWHERE = 0, 1, 2
# What became of a query.
OUTSIDE_HULL, INSIDE_HULL, NOT_FINITE, UNSURE = 0, 1, -1, -2


def new_work(indices: Indices) -> Floats:
    """Scratch memory for queries, one for each thread.

    Parameters
    ----------
    indices : integer array
        Of the packed diagram.
    """
    work = np.zeros(indices[WORK])
    work[indices[POWER] : indices[KEPT]] = UNKNOWN
    return work
