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

from ikns._kernels.voronoi import faces
from ikns.arrays import Array, Indices


@dataclass(frozen=True)
class Voronoi:
    """Delaunay triangulation and Voronoi diagram of N sites.

    T tetrahedra, F facets of which H are on the hull, E edges, S = 3 F sides, P pairs
    of sides of one face. Arrays are contiguous, of float64 and int64; a ``_rest`` is
    what the floats round off.
    """

    simplices: Indices  # (T, 4)
    neighbors: Indices  # (T, 4) across the facet without each vertex; -1 on the hull
    circumcenter: Array  # (T, 3) seen from the tetrahedron's first site
    circumcenter_rest: Array
    behind: Indices  # (F,) tetrahedron on one side of a facet
    ahead: Indices  # (F,) on the other; T on the hull
    length: Array  # (F,) of the facet's Voronoi edge; infinite on the hull
    normal: Array  # (F, 3) unit vector from behind to ahead
    normal_rest: Array
    hull: Indices  # (H,) which facets are on the hull
    hull_facets: Indices  # (H, 3) their sites, counterclockwise from outside
    edges: Indices  # (E, 2)
    axis: Array  # (E, 3) unit vector from site i to site j
    side_facet: Indices  # (S,) facet of a side
    side_edge: Indices  # (S,) and its edge
    entering: Indices  # (S,) tetrahedron at the start of the side; T at infinity
    leaving: Indices  # (S,) at its end
    first: Indices  # (P,) the pair's sides, in the order of their places
    second: Indices
    sine: Array  # (P,) of the angle by which the second side turns from the first
    pairs: Indices  # (E,) where the pairs of an edge's face begin, one after another

    def solid_angles(self, points: Array) -> Array:
        """Solid angles of the edges' faces, (E,) sr, seen from either of their sites.

        Exact to about 1e-15; all faces of a cell add up to 4 pi. Diagonals of
        co-spherical sites are chosen by chance or by rounding; their faces have no
        area, or hardly any, or they are far away. Their solid angle is small on any
        scale.
        """
        return faces.solid_angles(
            points,
            self.circumcenter + points[self.simplices[:, 0]],
            self.normal,
            self.edges,
            self.axis,
            self.side_facet,
            self.side_edge,
            self.entering,
            self.leaving,
        )
