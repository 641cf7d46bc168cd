"""A Voronoi diagram and values at its sites as two flat arrays, for compiled queries.

The layout is told in ikns._kernels.diagram.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels import diagram as at
from ikns.interpolation.domain import Domain
from ikns.interpolation.voronoi import Voronoi

__all__ = ["packed"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Sets with more tetrahedra are searched by walking, not by trying all.
_ALL = 40

_METHODS = {"sibson": at.SIBSON, "laplace": at.LAPLACE}
_RULES = {"nearest": at.NEAREST, "project": at.PROJECT, "nan": at.NOWHERE}


def packed(
    space: Domain, values: Floats, method: str, outside: str
) -> tuple[Floats, Indices]:
    """Pack what queries need.

    Parameters
    ----------
    space : Domain
    values : (N, M) array
    method : {"sibson", "laplace"}
    outside : {"nearest", "project", "nan"}

    Returns
    -------
    numbers : float array
    indices : integer array
    """
    d = space.diagram
    n, t, e = len(space.sites), len(d.simplices), len(d.edges)
    f, h = len(d.length), len(d.hull)
    lines = np.concatenate([np.flatnonzero(d.ahead < t), d.hull])  # the hull's last
    sides = np.bincount(d.side_edge)
    header = np.zeros(at.HEADER, dtype=np.int64)
    header[: at.WALK + 1] = [
        *(n, t, f, h, e, sides.max()),
        *(values.shape[1], _METHODS[method], _RULES[outside]),
        _middle(space) if t > _ALL else -1,
    ]
    rings, edges = _rings(d, lines, sides)
    blocks = {
        at.CORNER_LINES: _by_corner(
            np.concatenate([d.behind[lines], d.ahead[lines]]), np.tile(np.arange(f), 2)
        ),
        at.CORNER_EDGES: _by_corner(d.entering, d.side_edge),
        at.LINE_ENDS: np.column_stack([d.behind, d.ahead])[lines],
        at.HULL_SITES: d.hull_facets,
        at.EDGE_ROWS: edges,
        at.RING_LINES: rings,
    }
    _place(header, at.HEADER, {name: block.size for name, block in blocks.items()})
    numbers = {
        at.SITE: space.sites,
        at.CORNER: np.column_stack(
            [
                *(d.corner, d.corner_rest, space.sites[d.simplices[:, 0]]),
                1 + np.abs(d.corner).max(axis=1),
            ]
        ),
        at.LENGTH: np.where(np.isfinite(d.length), d.length, 0)[lines],
        at.PLANE: _planes(space, lines),
        at.AXIS: d.axis,
        at.VALUE: values,
        at.SINE: _sines(d, sides),
    }
    _place(header, at.NUMBERS, {name: block.size for name, block in numbers.items()})
    edges[:, 3] += header[at.RING_LINES]
    edges[:, 4] += header[at.SINE]
    room = {
        at.POWER: t + 1,
        at.KEPT: f,
        at.DEPTH: h,
        at.VOLUME: n,
        at.TOWARD: 3 * n,
        at.RING: int(sides.max()),
        at.LISTS: 3 + 2 * n + 2 * e + t,
    }
    header[at.WORK] = _place(header, 0, room)
    return (
        np.concatenate(
            [
                *([space.scale], space.center, [space.rounding]),
                *(block.ravel() for block in numbers.values()),
            ]
        ),
        np.concatenate([header, *(block.ravel() for block in blocks.values())]),
    )


def _place(header: Indices, start: int, sizes: dict[int, int]) -> int:
    """Note where blocks begin that follow each other; return where they end."""
    for name, size in sizes.items():
        header[name] = start
        start += size
    return start


def _middle(space: Domain) -> int:
    """Tetrahedron nearest to the middle of all sites."""
    middle = space.sites[space.diagram.simplices].mean(axis=1)
    return int(((middle - space.center) ** 2).sum(axis=1).argmin())


def _by_corner(corner: Indices, item: Indices) -> Indices:
    """Items of each tetrahedron, as many for all; those of infinity are left out."""
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner)
    return item[order][: count[0] * (len(count) - 1)]


def _planes(space: Domain, lines: Indices) -> Floats:
    """Rows of the planes of facets."""
    d = space.diagram
    site = np.empty(len(lines), dtype=np.int64)
    site[d.side_facet] = d.edges[d.side_edge, 0]  # the last one written, any will do
    site[d.hull] = d.hull_facets[:, 0]
    part = np.zeros(len(lines))
    part[d.hull] = 1 / space.center_depth
    return np.column_stack([d.normal, d.normal_rest, space.sites[site], part])[lines]


def _rings(d: Voronoi, lines: Indices, sides: Indices) -> tuple[Indices, Indices]:
    """Rings, and rows of edges: where among rings and sines theirs begin."""
    place = np.empty(len(lines), dtype=np.int64)
    place[lines] = np.arange(len(lines))
    begin = np.concatenate([[0], np.cumsum(3 * sides + 1)])
    first = np.concatenate([[0], np.cumsum(sides)])[:-1]
    rings = np.empty(begin[-1], dtype=np.int64)
    e = d.side_edge
    k = begin[e] + np.arange(len(e)) - first[e]
    rings[k] = rings[k + sides[e]] = place[d.side_facet]
    rings[k + 2 * sides[e]] = d.entering
    rings[begin[1:] - 1] = d.entering[first]
    sines = np.concatenate([[0], np.cumsum(sides * (sides - 1))])[:-1]
    return rings, np.column_stack([d.edges, sides, begin[:-1], sines])


def _sines(d: Voronoi, sides: Indices) -> Floats:
    """Sines of the angles from each side of a polygon to the following ones."""
    e = d.side_edge[d.first]
    begin = np.concatenate([[0], np.cumsum(sides * (sides - 1))])
    first = np.concatenate([[0], np.cumsum(sides)])[e]
    a, b, s = d.first - first, d.second - first, sides[e]
    sines = np.empty(begin[-1])
    sines[begin[e] + a * (s - 1) + b - a - 1] = d.sine
    sines[begin[e] + b * (s - 1) + a - b + s - 1] = -d.sine
    return sines
