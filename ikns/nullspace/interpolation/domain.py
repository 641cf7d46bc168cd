"""Sites, scaled to about 1, with their Voronoi diagram and their hull's measures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.nullspace.interpolation.diagram import diagram as voronoi
from ikns.nullspace.interpolation.sibson import depths
from ikns.nullspace.interpolation.voronoi import Voronoi

__all__ = ["Domain", "domain"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Domain:
    """Where natural neighbors interpolate.

    Parameters
    ----------
    scale : float
        A power of two: what points in m are multiplied with.
    sites : (N, 3) array
        Scaled.
    diagram : Voronoi
        Of the scaled sites.
    center : (3,) array
        The middle of the scaled sites.
    center_depth : (H,) array
        How far it lies behind each facet of the hull.
    rounding : float
        Scaled points that lie outside by less are on the hull.
    """

    scale: float
    sites: Floats
    diagram: Voronoi
    center: Floats
    center_depth: Floats
    rounding: float


def domain(points: Floats) -> Domain:
    """Prepare points (N, 3), m, that span space and are all different."""
    size = float(np.ptp(points, axis=0).max())
    # A power of two scales exactly.
    scale = 2.0 ** min(1000, -round(math.log2(size)))
    sites = points * scale
    diagram = voronoi(sites)
    center = sites.mean(axis=0)
    return Domain(
        scale=scale,
        sites=sites,
        diagram=diagram,
        center=center,
        center_depth=depths(diagram, sites, center[None], np.zeros((1, 3)))[0],
        rounding=float(8 * np.finfo(float).eps * max(1.0, np.abs(sites).max())),
    )
