"""The Voronoi diagram, built by compiled kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.delaunay import triangulate
from ikns._kernels.exact import on_lattice
from ikns._kernels.insertion_order import insertion_order
from ikns._kernels.rings import lines, rings
from ikns._kernels.voronoi import corners, lengths, normals, sines
from ikns.interpolation.voronoi import Voronoi, voronoi

__all__ = ["diagram"]

Floats = NDArray[np.float64]


def diagram(points: Floats) -> Voronoi:
    """Build the diagram of sites that span space and are all different.

    It is as exact as :func:`~ikns.interpolation.voronoi.voronoi`, thousands of times
    faster. Where sites are co-spherical, the two may choose other diagonals.

    Parameters
    ----------
    points : (N, 3) array
        Sites, scaled so that the set is about 1 wide.
    """
    sites = on_lattice(points)
    simplices, neighbors = triangulate(sites, insertion_order(points))
    if not len(simplices):
        return voronoi(points)
    outside = len(simplices)
    facets, behind, ahead = lines(simplices, neighbors)
    edges, begin, side_facet, side_edge, entering, leaving = rings(
        facets, behind, ahead, outside, len(points)
    )
    corner, corner_rest, volume = corners(sites, simplices)
    normal, normal_rest, area = normals(sites, facets)
    length = lengths(
        *(sites, simplices, neighbors, behind, ahead),
        *(corner, corner_rest, volume, area),
    )
    first, second, sine, pairs = sines(
        *(sites, facets, behind, normal, normal_rest, area),
        *(edges, begin, side_facet, entering),
    )
    hull = np.flatnonzero(ahead == outside)
    along = sites.x[edges[:, 1]] - sites.x[edges[:, 0]]
    return Voronoi(
        simplices=simplices,
        neighbors=neighbors,
        corner=corner,
        corner_rest=corner_rest,
        behind=behind,
        ahead=ahead,
        length=length,
        normal=normal,
        normal_rest=normal_rest,
        hull=hull,
        hull_facets=facets[hull],
        edges=edges,
        axis=along / np.linalg.norm(along, axis=1, keepdims=True),
        side_facet=side_facet,
        side_edge=side_edge,
        entering=entering,
        leaving=leaving,
        first=first,
        second=second,
        sine=sine,
        pairs=pairs,
    )
