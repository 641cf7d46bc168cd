"""Layout of a packed Voronoi diagram and of a query's scratch memory.

Passing an array from Python to compiled code costs 80 ns, as much as five Voronoi
faces. So a diagram is one array of floats that is also read as integers, bit by bit: a
header, scratch memory, integers and floats. The header has counts, options and the
places where blocks begin; blocks are rows of equal width, except those of edges. A copy
of a diagram holds all that a thread needs; or a thread brings other scratch memory.

A facet stands for its dual, the Voronoi edge; those of the hull come last. An edge has
the facets around it as a ring, then the tetrahedra that these start from, once around;
an open ring begins at infinity. Its sines are a row a facet: of the angle from that
facet to the next, to the one after that, and so on, once around. For each of its six
edges a tetrahedron has the place of the edge's integers, which facet of the ring leads
to it, and from which tetrahedron.
"""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices

# Places are unsigned: of signed ones numba checks whether they count from the end,
# which costs as much as what is done there.
place = np.uint64

# The header begins with counts, and the longest ring.
SITES, TETRAHEDRA, FACETS, HULL, EDGES, LONGEST, VALUES = range(7)
# Options, and the tetrahedron to start from; -1 where all are checked.
METHOD, OUTSIDE, MIDDLE = range(7, 10)
# Floats.
SCALE, CENTER, ROUNDING = 10, 11, 14
# Where blocks of scratch begin.
POWER = 15  # 1 a tetrahedron, and one for infinity: UNKNOWN between queries
KEPT = 16  # 1 a facet
DEPTH = 17  # 1 a hull facet
VOLUME = 18  # 1 a site, the weights in the end: 0 between queries
OFFSET = 19  # 3 a site: from the query to it
RING = 20  # 1 a facet of the longest ring
START = 21  # 1 integer: where the last walk ended
CAVITY = 22  # integers: tetrahedra of the cavity
NEIGHBORS = 23  # integers: its sites, the query's natural neighbors
MARK = 24  # 1 integer a site: 0 between queries
# Where blocks of integers begin, and their rows.
TETRAHEDRON = 25  # 30 each: facets, where these lead, sites, 3 for each edge
FACET_ENDS = 26  # 2 a facet: tetrahedra behind and ahead; TETRAHEDRA is infinity
HULL_SITES = 27  # 3 a hull facet
EDGE = 28  # 4 + 2 s an edge with s facets: sites i and j, s, floats, ring
# Where blocks of floats begin, and their rows.
SITE = 29  # 3 a site
CIRCUMCENTER = 30  # 10 a tetrahedron: center, its rest, first site, least sure power
LENGTH = 31  # 1 a facet, of its Voronoi edge; 0 on the hull
PLANE = 32  # 10 a facet: unit normal, its rest, a site; see hull_depths
ANGLE = 33  # 3 + s (s - 1) an edge with s facets: axis, sines
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


def new_work(indices: Indices) -> Array:
    """Scratch memory for queries of a packed diagram, one for each thread."""
    work = np.zeros(indices[TETRAHEDRON])  # the first block after all scratch
    work[indices[POWER] : indices[KEPT]] = UNKNOWN
    return work
