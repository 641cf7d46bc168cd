"""What a new site would steal from each Voronoi cell: Sibson's coordinates, unscaled.

The part stolen from cell i is the cell cut by one plane, the bisector of the query and
site i. With p = site - query, its volume is a sum over the cell's polygons, because
what closes the cut lies in that bisector (Gauss):

    V_i = sum_j A_ij (axis_ij . p_j) / 12

where A_ij is twice the polygon's area on the query's side. That side is told by one
number for each corner, its radius squared less its distance to the query squared. It
falls linearly along each line, so each line keeps one part of its length, and

    A = sum_{k < l} length_k length_l sin(angle from side k to side l)

over the kept sides in their order, from where the cut enters the polygon. Positions do
not appear, only lengths and angles, each accurate to its last digit: corners may be far
away or fall together, polygons may shrink to points or segments; nothing is special.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.nullspace.interpolation.twofold import difference, twofold_dot
from ikns.nullspace.interpolation.voronoi import Voronoi

__all__ = ["coordinates", "depths"]

Floats = NDArray[np.float64]

#: Where a product of floats is below this part of its terms, it is formed again with
#: twice the digits; above, rounding costs at most 1e-16 / 1e-3.
_CANCELED = 1e-3


def depths(diagram: Voronoi, sites: Floats, x: Floats, x_rest: Floats) -> Floats:
    """How far points lie behind each facet of the hull.

    Parameters
    ----------
    diagram : Voronoi
    sites : (N, 3) array
    x, x_rest : (Q, 3) array
        Points, as floats and what these round off.

    Returns
    -------
    (Q, H) array
        Positive inside. Exact in all digits, also where it is almost zero.
    """
    anchor = sites[diagram.hull_facets[:, 0]]
    normal, normal_rest = (
        diagram.normal[diagram.hull],
        diagram.normal_rest[diagram.hull],
    )
    depth = np.einsum("hk,qhk->qh", normal, anchor - x[:, None])
    q, h = np.nonzero(np.abs(depth) < _CANCELED)
    p, p_rest = difference(anchor[h], x[q])
    depth[q, h] = twofold_dot(normal[h], normal_rest[h], p, p_rest - x_rest[q])
    return depth


def _powers(diagram: Voronoi, sites: Floats, x: Floats, x_rest: Floats) -> Floats:
    """Squared radius less squared distance to the query, (Q, T): positive = stolen."""
    anchor = sites[diagram.simplices[:, 0]]
    p = x[:, None] - anchor
    power = np.einsum("qtk,qtk->qt", 2 * diagram.corner - p, p)
    scale = 1 + np.abs(diagram.corner).max(axis=1)
    q, t = np.nonzero(np.abs(power) < _CANCELED * scale)
    p, p_rest = difference(x[q], anchor[t])
    p_rest = p_rest + x_rest[q]
    reach, reach_rest = difference(2 * diagram.corner[t], p)
    reach_rest = reach_rest + 2 * diagram.corner_rest[t] - p_rest
    power[q, t] = twofold_dot(reach, reach_rest, p, p_rest)
    return power


def coordinates(
    diagram: Voronoi,
    sites: Floats,
    x: Floats,
    x_rest: Floats,
    depth: Floats,
    *,
    laplace: bool = False,
) -> Floats:
    """Sibson's or Laplace's coordinates of queries, before they are normalized.

    Parameters
    ----------
    diagram : Voronoi
    sites : (N, 3) array
        About 1 wide.
    x, x_rest : (Q, 3) array
        Queries strictly inside the hull, as floats and what these round off.
    depth : (Q, H) array
        Their :func:`depths`, all positive.
    laplace : bool

    Returns
    -------
    (Q, N) array
        Volume that each query would steal from each site's Voronoi cell; or twice the
        area of the face that would part them, over their distance.
    """
    d = diagram
    area = _kept_areas(d, sites, x, x_rest, depth)
    found = np.zeros((len(sites), len(x)))
    i, j = d.edges.T
    for mine, other, sign in ((i, j, 1.0), (j, i, -1.0)):
        p = sites[mine if laplace else other] - x[:, None]
        along = np.einsum("ek,qek->qe", sign * d.axis, p)
        np.add.at(found, mine, (area * along).T)
    if not laplace:
        return found.T / 12
    return -found.T / ((sites - x[:, None]) ** 2).sum(axis=2)


def _kept_areas(
    d: Voronoi, sites: Floats, x: Floats, x_rest: Floats, depth: Floats
) -> Floats:
    """Twice the area of each polygon on the query's side, (Q, E)."""
    power = np.empty((len(x), len(d.simplices) + 1))
    power[:, :-1] = _powers(d, sites, x, x_rest)
    power[:, -1] = -np.inf
    stolen = power > 0

    kept = _kept_lengths(d, power, stolen, depth)[:, d.side_facet]
    start = np.zeros((len(x), len(d.edges)), dtype=np.intp)
    q, side = np.nonzero(~stolen[:, d.entering] & stolen[:, d.leaving])
    start[q, d.side_edge[side]] = side
    start = start[:, d.side_edge[d.first]]
    swapped = (d.first < start) & (start <= d.second)
    area = kept[:, d.first] * kept[:, d.second] * np.where(swapped, -d.sine, d.sine)
    return np.add.reduceat(area, d.pairs, axis=1)


def _kept_lengths(
    d: Voronoi, power: Floats, stolen: NDArray[np.bool_], depth: Floats
) -> Floats:
    """Length of each line on the query's side, (Q, F)."""
    behind, ahead = power[:, d.behind], power[:, d.ahead]
    share = np.zeros_like(behind)
    from_behind = stolen[:, d.behind] & ~stolen[:, d.ahead]
    from_ahead = stolen[:, d.ahead] & ~stolen[:, d.behind]
    share[stolen[:, d.behind] & stolen[:, d.ahead]] = 1
    np.divide(behind, behind - ahead, out=share, where=from_behind)
    np.divide(ahead, ahead - behind, out=share, where=from_ahead)
    share[:, d.hull] = behind[:, d.hull].clip(0, None) / (2 * depth)
    return share * np.where(np.isfinite(d.length), d.length, 1.0)
