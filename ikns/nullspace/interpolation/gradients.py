"""Gradients at the sites, for Sibson's smooth interpolant."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.nullspace.interpolation.domain import Domain

__all__ = ["scaled_gradients"]


def scaled_gradients(
    space: Domain, angle: Array, values: Array | None, gradients: ArrayLike | None
) -> Array:
    """Gradients at the sites: those that are given, or estimated from the values.

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
    """Least-squares gradients: of the plane through a site's value that fits others.

    Each neighbor is weighted with the solid angle of the face between over the squared
    distance. Values that are linear in space have their own gradients.
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
