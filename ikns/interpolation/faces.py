"""How large the faces between Voronoi cells look from their sites."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.interpolation.voronoi import Voronoi

__all__ = ["solid_angles"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


def solid_angles(diagram: Voronoi, points: Floats) -> Floats:
    """How much of site i's view the face that it shares with site j fills.

    Diagonals of co-spherical sites are chosen by chance or by rounding; their polygons
    have no area, or hardly any, or they are far away. This tells them from the others
    on any scale.

    Parameters
    ----------
    diagram : Voronoi
    points : (N, 3) array
        The sites that it was built from.

    Returns
    -------
    (E,) array
        Steradian, to about 1e-15; the whole view is 4 pi.
    """
    d, outside = diagram, len(diagram.simplices)
    corner = np.vstack([d.corner + points[d.simplices[:, 0]], np.zeros(3)])

    def seen(at: Indices) -> Floats:
        away = corner[at] - points[d.edges[d.side_edge, 0]]
        away[at == outside] = d.normal[d.side_facet[at == outside]]
        return away / np.linalg.norm(away, axis=1, keepdims=True)

    start, end = seen(d.entering), seen(d.leaving)
    angle = np.add.reduceat(
        _solid_angle(d.axis[d.side_edge], start, end),
        np.searchsorted(d.side_edge, np.arange(len(d.edges))),
    )
    # From ray to ray along the horizon, where the polygon is open.
    last, first = (np.flatnonzero(at == outside) for at in (d.leaving, d.entering))
    edge = d.side_edge[first]
    angle[edge] += _solid_angle(d.axis[edge], end[last], start[first])
    return angle


def _solid_angle(a: Floats, b: Floats, c: Floats) -> Floats:
    """Signed solid angle of three unit vectors (Van Oosterom and Strackee, 1983)."""
    volume = (a * np.cross(b, c)).sum(axis=1)
    return 2 * np.arctan2(volume, 1 + (a * b + b * c + c * a).sum(axis=1))
