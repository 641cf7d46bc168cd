"""A Voronoi diagram and values at its sites as one flat array, for compiled queries.

The layout is told in ikns._kernels.voronoi.diagram. Tetrahedra, lines and edges are
numbered anew, so that those that are close in space are close in memory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.voronoi import diagram as at
from ikns._kernels.voronoi.hull import CANCELED
from ikns.nullspace.interpolation.domain import Domain
from ikns.nullspace.interpolation.morton import morton_order
from ikns.nullspace.interpolation.voronoi import Voronoi

__all__ = ["FEW", "packed"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Up to so many tetrahedra trying all is faster than walking (measured).
FEW = 60

_METHODS = {"sibson": at.SIBSON, "laplace": at.LAPLACE, "sibson_c1": at.SMOOTH}
_RULES = {"nearest": at.NEAREST, "project": at.PROJECT, "nan": at.NOWHERE}


def packed(
    space: Domain, values: Floats, slopes: Floats, method: str, outside: str
) -> Floats:
    """Pack what queries need.

    Parameters
    ----------
    space : Domain
    values : (N, M) array
    slopes : (N, M, 3) array
        Of the values, per scaled unit of length, for "sibson_c1" only.
    method : {"sibson", "laplace", "sibson_c1"}
    outside : {"nearest", "project", "nan"}

    Returns
    -------
    (K,) array
    """
    d = space.diagram
    n, t = len(space.sites), len(d.simplices)
    f, h = len(d.length), len(d.hull)
    middle = space.sites[d.simplices].mean(axis=1)
    corners = morton_order(middle, space.sites.min(axis=0), space.sites.max(axis=0))
    number = np.append(_turns(corners), t)  # of each tetrahedron; infinity stays last
    lines = np.argsort(np.where(d.ahead < t, number[d.behind], t), kind="stable")
    lines[f - h :] = d.hull  # the hull's come last
    ends = number[np.concatenate([d.behind[lines], d.ahead[lines]])]
    slots, rings, angles = _edges(d, number, _turns(lines))
    integers = {
        at.CORNER_ROWS: np.column_stack(
            [
                *_by_corner(ends, np.tile(np.arange(f), 2), np.roll(ends, f)),
                d.simplices[corners],
                slots,
            ]
        ),
        at.LINE_ENDS: ends.reshape(2, -1).T,
        at.HULL_SITES: d.hull_facets,
        at.EDGE: rings,
    }
    first = space.sites[d.simplices[:, 0]]
    sure = CANCELED * (1 + np.abs(d.corner).max(axis=1))
    floats = {
        at.SITE: space.sites,
        at.CORNER: np.column_stack([d.corner, d.corner_rest, first, sure])[corners],
        at.LENGTH: np.where(np.isfinite(d.length), d.length, 0)[lines],
        at.PLANE: _planes(space)[lines],
        at.ANGLE: angles,
        at.VALUE: values,
        at.GRADIENT: slopes,
    }
    longest = int(np.bincount(d.side_edge).max())
    scratch = {
        at.POWER: t + 1,
        at.KEPT: f,
        at.DEPTH: h,
        at.VOLUME: n,
        at.TOWARD: 3 * n,
        at.RING: longest,
        at.START: 1,
        at.FOUND: t + 1,
        at.NEAR: n,
        at.MARK: n,
    }
    start = int(((middle[corners] - space.center) ** 2).sum(axis=1).argmin())
    header = np.zeros(at.HEADER, dtype=np.int64)
    header[: at.MIDDLE + 1] = [
        *(n, t, f, h, len(d.edges), longest, values.shape[1]),
        *(_METHODS[method], _RULES[outside], start if t > FEW else -1),
    ]
    header[at.SCALE : at.ROUNDING + 1] = np.array(
        [space.scale, *space.center, space.rounding]
    ).view(np.int64)
    blocks = {name: np.zeros(size, dtype=np.int64) for name, size in scratch.items()}
    blocks[at.POWER] = np.full(t + 1, at.UNKNOWN)
    blocks |= integers | floats
    place = at.HEADER
    for name, block in blocks.items():
        header[name] = place
        place += block.size
    parts = (np.ascontiguousarray(block).ravel() for block in blocks.values())
    return np.concatenate(
        [header.view(np.float64), *(part.view(np.float64) for part in parts)]
    )


def _turns(order: Indices) -> Indices:
    """Tell for each item when its turn comes in an order."""
    turn = np.empty(len(order), dtype=np.int64)
    turn[order] = np.arange(len(order))
    return turn


def _by_corner(corner: Indices, *items: Indices) -> list[Indices]:
    """Items of each tetrahedron, a row each; those of infinity are left out."""
    order = np.argsort(corner, kind="stable")
    corners = int(corner.max())
    order = order[: np.searchsorted(corner[order], corners)]
    return [item[order].reshape(corners, -1) for item in items]


def _planes(space: Domain) -> Floats:
    """Rows of the planes of facets."""
    d = space.diagram
    site = np.empty(len(d.length), dtype=np.int64)
    site[d.side_facet] = d.edges[d.side_edge, 0]  # any of its three sites will do
    site[d.hull] = d.hull_facets[:, 0]
    part = np.zeros(len(d.length))
    part[d.hull] = 1 / space.center_depth
    return np.column_stack([d.normal, d.normal_rest, space.sites[site], part])


def _edges(
    d: Voronoi, number: Indices, line: Indices
) -> tuple[Indices, Indices, Floats]:
    """Edges as their tetrahedra know them, their integers and their floats."""
    e, sides = d.side_edge, np.bincount(d.side_edge)
    first = np.cumsum(sides) - sides
    corner, k = number[d.entering], np.arange(len(e)) - first[e]
    order = np.argsort(np.minimum.reduceat(corner, first), kind="stable")
    begin = np.empty((2, len(sides)), dtype=np.int64)
    for row, width in zip(begin, (4 + 2 * sides, 3 + sides * (sides - 1)), strict=True):
        row[order] = np.cumsum(width[order]) - width[order]
    edge, angle = begin

    before = first[e] + (k - 1) % sides[e]
    slots = _by_corner(corner, edge[e], before - first[e], corner[before])
    integers = np.empty((4 + 2 * sides).sum(), dtype=np.int64)
    for place, item in enumerate((*d.edges.T, sides, angle)):
        integers[edge + place] = item
    integers[edge[e] + 4 + k] = line[d.side_facet]
    integers[edge[e] + 4 + sides[e] + k] = corner

    floats = np.empty((3 + sides * (sides - 1)).sum())
    for place in range(3):
        floats[angle + place] = d.axis[:, place]
    e = d.side_edge[d.first]
    a, b, s = d.first - first[e], d.second - first[e], sides[e]
    floats[angle[e] + 3 + a * (s - 1) + b - a - 1] = d.sine
    floats[angle[e] + 3 + b * (s - 1) + a - b + s - 1] = -d.sine
    return np.stack(slots, axis=2).reshape(-1, 18), integers, floats
