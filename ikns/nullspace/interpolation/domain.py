"""Sites, scaled to about 1: their Voronoi diagram, their hull, gradients at them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ikns._kernels.voronoi.hull import CANCELED
from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.nullspace.interpolation.diagram import diagram as voronoi
from ikns.nullspace.interpolation.double_double import difference, double_double_dot
from ikns.nullspace.interpolation.voronoi import Voronoi


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
    return _domain(np.ascontiguousarray(points).tobytes())


@lru_cache(maxsize=4)
def _domain(places: bytes) -> Domain:
    """Do so once: the maps of a subject share their points."""
    points = np.frombuffer(places).reshape(-1, 3)
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


def scaled_gradients(
    space: Domain, angle: Array, values: Array | None, gradients: ArrayLike | None
) -> Array:
    """Gradients for Sibson's smooth interpolant: given, or estimated from the values.

    The solid angles of the edges' faces are (E,), values (N, ...), gradients (N, ...,
    3) per m; the result (N, M, 3) is per scaled unit of length.
    """
    if values is None:
        raise InvalidInput("method 'sibson_c1' needs values.")
    if gradients is None:
        return _estimated(space, angle, values.reshape(len(values), -1))
    given = np.array(gradients, dtype=np.float64)
    if given.shape != (*values.shape, 3):
        raise InvalidInput(
            f"expected gradients of shape {(*values.shape, 3)}, one for each value, "
            f"found {given.shape}."
        )
    if not np.isfinite(given).all():
        raise InvalidInput("all gradients must be finite, found NaN or infinity.")
    return given.reshape(len(values), -1, 3) / space.scale


def _estimated(space: Domain, angle: Array, values: Array) -> Array:
    """Least-squares gradients: of a linear fit to the neighbors' values.

    Each neighbor is weighted with the solid angle of the face between over the squared
    distance. Gradients of values that are linear in space are exact.
    """
    edges = space.diagram.edges
    mine = np.concatenate([edges[:, 0], edges[:, 1]])
    other = np.concatenate([edges[:, 1], edges[:, 0]])
    step = space.sites[other] - space.sites[mine]
    weight = np.sqrt(np.tile(angle.clip(0, None), 2) / (step**2).sum(axis=1))[:, None]
    step, rise = weight * step, weight * (values[other] - values[mine])
    order, neighbors = np.argsort(mine, kind="stable"), np.bincount(mine)
    first = np.cumsum(neighbors) - neighbors
    found = np.empty((len(neighbors), values.shape[1], 3))
    for count in np.unique(neighbors):
        sites = np.flatnonzero(neighbors == count)
        rows = order[first[sites, None] + np.arange(count)]
        found[sites] = (np.linalg.pinv(step[rows]) @ rise[rows]).transpose(0, 2, 1)
    return found
