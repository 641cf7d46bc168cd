"""The Delaunay triangulation of some sites and its dual, the Voronoi diagram.

Tetrahedra, facets and edges are those of the triangulation. Each has its dual:

- of a tetrahedron its circumcenter, a vertex of the Voronoi diagram;
- of a facet a Voronoi edge, normal to it, from the circumcenter behind the facet to the
  one ahead of it; from a facet of the hull a ray to infinity;
- of an edge, two sites i < j, the Voronoi face that their cells share, normal to it.
  Its sides are the Voronoi edges of the facets around the edge, counterclockwise; the
  face of an edge of the hull is open, from ray to ray.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Voronoi"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Voronoi:
    """Delaunay triangulation and Voronoi diagram of N sites.

    T tetrahedra, F facets of which H are on the hull, E edges, S = 3 F sides, P pairs
    of sides of one face. Arrays are contiguous, of float64 and int64.

    Parameters
    ----------
    simplices : (T, 4) integer array
    neighbors : (T, 4) integer array
        The tetrahedron across the facet that leaves out each vertex; -1 on the hull.
    circumcenter, circumcenter_rest : (T, 3) array
        Seen from the tetrahedron's first site: floats, and what these round off.
    behind, ahead : (F,) integer array
        Tetrahedra on the two sides of a facet; `ahead` is T on the hull.
    length : (F,) array
        Of the facet's Voronoi edge; infinite on the hull.
    normal, normal_rest : (F, 3) array
        Unit vector from behind to ahead: floats, and what these round off.
    hull : (H,) integer array
        Which facets are on the hull.
    hull_facets : (H, 3) integer array
        Their sites, counterclockwise from outside.
    edges : (E, 2) integer array
    axis : (E, 3) array
        Unit vector from site i to site j.
    side_facet, side_edge : (S,) integer array
        Facet and edge of a side.
    entering, leaving : (S,) integer array
        Tetrahedra at the start and at the end of the side; T at infinity.
    first, second : (P,) integer array
        The pair's sides, in the order of their places.
    sine : (P,) array
        Sine of the angle by which the second side turns from the first.
    pairs : (E,) integer array
        Where the pairs of an edge's face begin; they follow each other.
    """

    simplices: Indices
    neighbors: Indices
    circumcenter: Floats
    circumcenter_rest: Floats
    behind: Indices
    ahead: Indices
    length: Floats
    normal: Floats
    normal_rest: Floats
    hull: Indices
    hull_facets: Indices
    edges: Indices
    axis: Floats
    side_facet: Indices
    side_edge: Indices
    entering: Indices
    leaving: Indices
    first: Indices
    second: Indices
    sine: Floats
    pairs: Indices
