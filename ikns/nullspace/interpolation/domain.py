"""Sites, scaled to about 1, with their Voronoi diagram and their hull's measures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ikns._kernels.voronoi.hull import CANCELED
from ikns.arrays import Array
from ikns.nullspace.interpolation.diagram import diagram as voronoi
from ikns.nullspace.interpolation.double_double import difference, double_double_dot
from ikns.nullspace.interpolation.voronoi import Voronoi

__all__ = ["Domain", "domain"]


@dataclass(frozen=True)
class Domain:
    """Where natural neighbors interpolate."""

    scale: float  # a power of two: what points in m are multiplied with
    sites: Array  # (N, 3) scaled
    diagram: Voronoi  # of the scaled sites
    center: Array  # (3,) the middle of the scaled sites
    center_depth: Array  # (H,) how far it lies behind each facet of the hull
    rounding: float  # scaled points that lie outside by less are on the hull


def domain(points: Array) -> Domain:
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
        center_depth=_depths(diagram, sites, center),
        rounding=float(8 * np.finfo(float).eps * max(1.0, np.abs(sites).max())),
    )


def _depths(diagram: Voronoi, sites: Array, x: Array) -> Array:
    """How far a point lies behind each facet of the hull, (H,); positive inside."""
    site = sites[diagram.hull_facets[:, 0]]
    normal, rest = diagram.normal[diagram.hull], diagram.normal_rest[diagram.hull]
    depth = np.einsum("hk,hk->h", normal, site - x)
    near = np.flatnonzero(np.abs(depth) < CANCELED)
    p, p_rest = difference(site[near], x)
    depth[near] = double_double_dot(normal[near], rest[near], p, p_rest)
    return depth
