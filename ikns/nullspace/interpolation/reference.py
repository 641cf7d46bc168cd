"""Natural-neighbor weights in NumPy, all queries at once: what the kernel must equal.

The kernel (ikns._kernels.voronoi.query) takes the same steps for one query; where it
cannot trust itself, these are its second opinion. Tests hold both to exact arithmetic.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.nullspace.interpolation.domain import Domain
from ikns.nullspace.interpolation.hull import nearest_on_hull
from ikns.nullspace.interpolation.sibson import coordinates, depths
from ikns.nullspace.interpolation.twofold import difference

__all__ = ["Outside", "placed", "reference_weights", "scaled"]

Outside = Literal["nearest", "project", "nan"]
Floats = NDArray[np.float64]

#: Queries nearer to the hull than this part of the way to the middle are moved in to
#: there. The hull of a box whose corners are rounded is uneven by 1e-16, and this near
#: to it weights would tell which way.
_SKIN = 1e-11
#: Queries farther out are brought this near: only their direction matters there.
_FAR = 1e9


def reference_weights(
    space: Domain, x: Floats, outside: Outside, *, laplace: bool = False
) -> tuple[Floats, Floats]:
    """Weights of the sites.

    Parameters
    ----------
    space : Domain
    x : (Q, 3) array
        Queries, m. A query that is not finite gives NaN.
    outside : {"nearest", "project", "nan"}
        What holds outside the hull.
    laplace : bool
        Laplace's coordinates in place of Sibson's.

    Returns
    -------
    weights : (Q, N) array
    places : (Q, 3) array
        Where the weights hold, in the domain's units.
    """
    places = scaled(space, x)
    weights = np.full((len(places), len(space.sites)), np.nan)
    seen = np.flatnonzero(np.isfinite(places).all(axis=1))
    step = max(1, 50_000 // len(space.diagram.side_edge))  # blocks that fit a cache
    for start in range(0, len(seen), step):
        rows = seen[start : start + step]
        weights[rows], places[rows] = _block(space, places[rows], outside, laplace)
    return weights, places


def scaled(space: Domain, x: Floats) -> Floats:
    """Bring queries, m, near, in the domain's units; where they overflow, infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        queries = x * space.scale
        away = queries - space.center
        reach = np.abs(away).max(axis=1, initial=0)
        far = (reach > _FAR) & np.isfinite(reach)
    queries[far] = space.center + away[far] / reach[far, None] * _FAR
    return queries


def placed(
    space: Domain, x: Floats, outside: Outside
) -> tuple[Floats, NDArray[np.bool_]]:
    """Project scaled queries where that is the rule; also say which are in the hull."""
    within = _depths(space, x).min(axis=1) >= -space.rounding
    away, x = np.flatnonzero(~within), x.copy()
    if outside == "project" and away.size:
        facets = space.diagram.hull_facets
        x[away] = nearest_on_hull(space.sites, facets, x[away])
    return x, within


def _depths(space: Domain, x: Floats) -> Floats:
    return depths(space.diagram, space.sites, x, np.zeros_like(x))


def _block(
    space: Domain, x: Floats, outside: Outside, laplace: bool
) -> tuple[Floats, Floats]:
    """Weights of finite, scaled queries, (Q, N), and where they hold, (Q, 3)."""
    weights = np.full((len(x), len(space.sites)), np.nan)
    x, within = placed(space, x, outside)
    if outside == "nearest":
        away = np.flatnonzero(~within)
        weights[away] = np.eye(len(space.sites))[_nearest(space, x[away])[0]]

    rows = np.arange(len(x)) if outside == "project" else np.flatnonzero(within)
    nearest, square = _nearest(space, x[rows])
    at_site = square <= 1e-36  # nearer, nothing could be told apart
    weights[rows[at_site]] = np.eye(len(space.sites))[nearest[at_site]]
    rows = rows[~at_site]
    weights[rows], x[rows] = _inside(space, x[rows], laplace)
    return weights, x


def _nearest(space: Domain, x: Floats) -> tuple[NDArray[np.intp], Floats]:
    square = ((x[:, None] - space.sites) ** 2).sum(axis=2)
    nearest = square.argmin(axis=1)
    return nearest, square[np.arange(len(x)), nearest]


def _inside(space: Domain, x: Floats, laplace: bool) -> tuple[Floats, Floats]:
    """Weights of queries in the hull that are not sites, and the queries, moved in."""
    # Part of the way from the hull to the middle: linear along every such ray.
    depth = _depths(space, x)
    part = (depth / space.center_depth).min(axis=1, initial=np.inf)
    x, rest = x.copy(), np.zeros_like(x)  # may move by less than floats can tell
    low = np.flatnonzero(part < _SKIN)
    step = (_SKIN - part[low]) / (1 - part[low])
    x[low], rest[low] = difference(x[low], step[:, None] * (x[low] - space.center))
    depth[low] = depths(space.diagram, space.sites, x[low], rest[low])
    found = coordinates(space.diagram, space.sites, x, rest, depth, laplace=laplace)
    weights = found / found.sum(axis=1, keepdims=True)
    if not (weights >= -1e-9).all():  # never seen: rounding leaves -1e-15
        raise ArithmeticError(
            f"a natural-neighbor weight came out as {weights.min():g} where 0 or "
            "more is certain."
        )
    weights = weights.clip(0, None)
    return weights / weights.sum(axis=1, keepdims=True), x
