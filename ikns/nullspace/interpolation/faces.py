"""Solid angles of Voronoi faces."""

from __future__ import annotations

from ikns._kernels.voronoi import faces
from ikns.arrays import Array
from ikns.nullspace.interpolation.voronoi import Voronoi

__all__ = ["solid_angles"]


def solid_angles(diagram: Voronoi, points: Array) -> Array:
    """Solid angle of the face of each edge, seen from either of its sites.

    Diagonals of co-spherical sites are chosen by chance or by rounding; their faces
    have no area, or hardly any, or they are far away. Their solid angle
    is small on any scale.

    Parameters
    ----------
    diagram : Voronoi
    points : (N, 3) array
        The sites that it was built from.

    Returns
    -------
    (E,) array
        Steradian, to about 1e-15; all faces of a cell add up to 4 pi.
    """
    d = diagram
    return faces.solid_angles(
        points,
        d.circumcenter + points[d.simplices[:, 0]],
        d.normal,
        d.edges,
        d.axis,
        d.side_facet,
        d.side_edge,
        d.entering,
        d.leaving,
    )
