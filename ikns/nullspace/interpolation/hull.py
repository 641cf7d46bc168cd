"""The point of a convex hull that is nearest to a query."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["nearest_on_hull"]

Floats = NDArray[np.float64]


def _on_segments(a: Floats, b: Floats, x: Floats) -> Floats:
    """Nearest points of H segments to Q points, (Q, H, 3)."""
    along = b - a
    t = np.einsum("hk,qhk->qh", along, x[:, None] - a) / (along * along).sum(axis=1)
    return a + t.clip(0, 1)[..., None] * along


def _on_planes(a: Floats, b: Floats, c: Floats, x: Floats) -> Floats:
    """Feet of Q points on H triangles, (Q, H, 3); a corner where the foot is off."""
    u, v = b - a, c - a
    normal = np.cross(u, v)
    square = (normal * normal).sum(axis=1)
    w = x[:, None] - a
    with np.errstate(divide="ignore", invalid="ignore"):  # triangles flat to rounding
        s = np.einsum("hk,qhk->qh", np.cross(v, normal), w) / square
        t = np.einsum("hk,qhk->qh", np.cross(normal, u), w) / square
        on = (s >= 0) & (t >= 0) & (s + t <= 1)
    s, t = np.where(on, s, 0.0), np.where(on, t, 0.0)
    return a + s[..., None] * u + t[..., None] * v


def nearest_on_hull(sites: Floats, facets: NDArray[np.intp], x: Floats) -> Floats:
    """Project queries outside a convex hull onto it.

    The nearest point y is the one behind whose plane, at a right angle to x - y, all
    sites lie. Comparing distances alone would tell y only to 1e-8, because they are
    stationary there; so distances choose a few candidates and the sites choose y.

    Parameters
    ----------
    sites : (N, 3) array
    facets : (H, 3) integer array
        Triangles of the hull.
    x : (Q, 3) array

    Returns
    -------
    (Q, 3) array
    """
    a, b, c = (sites[facets[:, k]] for k in range(3))
    candidates = np.concatenate(
        [
            _on_planes(a, b, c, x),
            _on_segments(a, b, x),
            _on_segments(b, c, x),
            _on_segments(c, a, x),
        ],
        axis=1,
    )
    square = ((x[:, None] - candidates) ** 2).sum(axis=2)
    q, k = np.nonzero(square <= square.min(axis=1, keepdims=True) * (1 + 1e-12))
    y = candidates[q, k]
    vertices = sites[np.unique(facets)]
    ahead = np.einsum("mk,mnk->mn", x[q] - y, vertices - y[:, None]).max(axis=1)
    best = np.lexsort((ahead, q))
    return y[best[np.searchsorted(q, np.arange(len(x)))]]
