"""A Voronoi diagram and values at its sites as one flat array, for compiled queries.

The layout is described in ikns._kernels.voronoi.diagram. Tetrahedra, facets and edges
are renumbered, so that those that are close in space are close in memory.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.voronoi import diagram as at
from ikns._kernels.voronoi.hull import CANCELED
from ikns.arrays import Array, Indices
from ikns.nullspace.interpolation.domain import Domain
from ikns.nullspace.interpolation.voronoi import Voronoi

#: Up to so many tetrahedra checking all is faster than walking (measured).
BRUTE_FORCE_LIMIT = 60
#: Bits for each axis: a cell for each of a billion sites.
_BITS = 10

_METHODS = {"sibson": at.SIBSON, "laplace": at.LAPLACE, "sibson_c1": at.SMOOTH}
_RULES = {"nearest": at.NEAREST, "project": at.PROJECT, "nan": at.NOWHERE}


def packed(
    space: Domain, values: Array, gradients: Array, method: str, outside: str
) -> Array:
    """Pack what queries need: values (N, M), and gradients (N, M, 3) for "sibson_c1".

    Gradients are per scaled unit of length. Method and rule outside the hull are those
    of :class:`ikns.NaturalNeighborInterpolator`.
    """
    d = space.diagram
    n, t = len(space.sites), len(d.simplices)
    f, h = len(d.length), len(d.hull)
    middle = space.sites[d.simplices].mean(axis=1)
    order = morton_order(middle, space.sites.min(axis=0), space.sites.max(axis=0))
    number = np.append(_inverse(order), t)  # of each tetrahedron; infinity stays last
    facets = np.argsort(np.where(d.ahead < t, number[d.behind], t), kind="stable")
    facets[f - h :] = d.hull  # the hull's come last
    ends = number[np.concatenate([d.behind[facets], d.ahead[facets]])]
    slots, rings, angles = _edges(d, number, _inverse(facets))
    integers = {
        at.TETRAHEDRON: np.column_stack(
            [
                *_by_tetrahedron(ends, np.tile(np.arange(f), 2), np.roll(ends, f)),
                d.simplices[order],
                slots,
            ]
        ),
        at.FACET_ENDS: ends.reshape(2, -1).T,
        at.HULL_SITES: d.hull_facets,
        at.EDGE: rings,
    }
    first = space.sites[d.simplices[:, 0]]
    sure = CANCELED * (1 + np.abs(d.circumcenter).max(axis=1))
    floats = {
        at.SITE: space.sites,
        at.CIRCUMCENTER: np.column_stack(
            [d.circumcenter, d.circumcenter_rest, first, sure]
        )[order],
        at.LENGTH: np.where(np.isfinite(d.length), d.length, 0)[facets],
        at.PLANE: _planes(space)[facets],
        at.ANGLE: angles,
        at.VALUE: values,
        at.GRADIENT: gradients,
    }
    longest = int(np.bincount(d.side_edge).max())
    scratch = {
        at.POWER: t + 1,
        at.KEPT: f,
        at.DEPTH: h,
        at.VOLUME: n,
        at.OFFSET: 3 * n,
        at.RING: longest,
        at.START: 1,
        at.CAVITY: t + 1,
        at.NEIGHBORS: n,
        at.MARK: n,
    }
    start = int(((middle[order] - space.center) ** 2).sum(axis=1).argmin())
    header = np.zeros(at.HEADER, dtype=np.int64)
    header[: at.MIDDLE + 1] = [
        *(n, t, f, h, len(d.edges), longest, values.shape[1]),
        *(_METHODS[method], _RULES[outside], start if t > BRUTE_FORCE_LIMIT else -1),
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


def morton_order(places: Array, low: Array, high: Array) -> Indices:
    """Sort places (Q, 3) along the Z-shaped curve (G. M. Morton, IBM, 1966).

    Neighbors are mostly close together. Those that are not finite may come anywhere;
    places outside of the box from `low` to `high` are taken for the nearest in it.
    """
    share = (np.nan_to_num(places).clip(low, high) - low) / (high - low)
    cell = (share * (2**_BITS - 1)).astype(np.int64)
    code = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _inverse(order: Indices) -> Indices:
    """Return the inverse of a permutation."""
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rank


def _by_tetrahedron(tetrahedron: Indices, *items: Indices) -> list[Indices]:
    """Items of each tetrahedron, a row each; those of infinity are left out."""
    order = np.argsort(tetrahedron, kind="stable")
    count = int(tetrahedron.max())
    order = order[: np.searchsorted(tetrahedron[order], count)]
    return [item[order].reshape(count, -1) for item in items]


def _planes(space: Domain) -> Array:
    """Rows of the planes of facets."""
    d = space.diagram
    site = np.empty(len(d.length), dtype=np.int64)
    site[d.side_facet] = d.edges[d.side_edge, 0]  # any of its three sites will do
    site[d.hull] = d.hull_facets[:, 0]
    part = np.zeros(len(d.length))
    part[d.hull] = 1 / space.center_depth
    return np.column_stack([d.normal, d.normal_rest, space.sites[site], part])


def _edges(
    d: Voronoi, number: Indices, facet: Indices
) -> tuple[Indices, Indices, Array]:
    """Slots of the tetrahedra's edges, integers and floats of the edges."""
    e, sides = d.side_edge, np.bincount(d.side_edge)
    first = np.cumsum(sides) - sides
    tetrahedron, k = number[d.entering], np.arange(len(e)) - first[e]
    order = np.argsort(np.minimum.reduceat(tetrahedron, first), kind="stable")
    begin = np.empty((2, len(sides)), dtype=np.int64)
    for row, width in zip(begin, (4 + 2 * sides, 3 + sides * (sides - 1)), strict=True):
        row[order] = np.cumsum(width[order]) - width[order]
    edge, angle = begin

    before = first[e] + (k - 1) % sides[e]
    slots = _by_tetrahedron(
        tetrahedron, edge[e], before - first[e], tetrahedron[before]
    )
    integers = np.empty((4 + 2 * sides).sum(), dtype=np.int64)
    for place, item in enumerate((*d.edges.T, sides, angle)):
        integers[edge + place] = item
    integers[edge[e] + 4 + k] = facet[d.side_facet]
    integers[edge[e] + 4 + sides[e] + k] = tetrahedron

    floats = np.empty((3 + sides * (sides - 1)).sum())
    for place in range(3):
        floats[angle + place] = d.axis[:, place]
    e = d.side_edge[d.first]
    a, b, s = d.first - first[e], d.second - first[e], sides[e]
    floats[angle[e] + 3 + a * (s - 1) + b - a - 1] = d.sine
    floats[angle[e] + 3 + b * (s - 1) + a - b + s - 1] = -d.sine
    return np.stack(slots, axis=2).reshape(-1, 18), integers, floats
