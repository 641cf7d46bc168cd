"""Batch queries of small sets: the sums of `cavity` and `sibson`, vectorized.

Every tetrahedron and face is checked for a whole row of queries at a time, which
processors do for several in one instruction. Only plain queries are answered: inside
the hull, and where no product cancels. The others are left for `query`.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.cavity import kept_length
from ikns._kernels.voronoi.diagram import (
    ANGLE,
    CIRCUMCENTER,
    EDGE,
    EDGES,
    FACET_ENDS,
    FACETS,
    HULL,
    INSIDE_HULL,
    LAPLACE,
    LENGTH,
    LONGEST,
    METHOD,
    PLANE,
    SCALE,
    SITE,
    SITES,
    TETRAHEDRA,
    UNKNOWN,
    UNSURE,
    VALUE,
    VALUES,
    place,
)
from ikns._kernels.voronoi.hull import CANCELED
from ikns._kernels.voronoi.query import NEGATIVE
from ikns.arrays import Array, Indices


def batch_scratch_rows(indices: Indices) -> int:
    """Rows of scratch memory that `answer_batch` needs."""
    n = indices[LONGEST] + indices[TETRAHEDRA] + indices[FACETS] + indices[HULL]
    return int(n + 4 * indices[SITES] + 7)


@compiled
def answer_batch(
    numbers: Array,
    indices: Indices,
    x: Array,
    work: Array,
    weigh: int,
    out: Array,
    status: Indices,
) -> None:
    """Write weights (Q, N) or values (Q, M) and the status (Q,) of queries (Q, 3).

    UNSURE where a query is not plain. Scratch is an array of `batch_scratch_rows` by as
    many queries as are answered at a time.
    """
    n, t = indices[SITES], indices[TETRAHEDRA]
    places, plain, turn, area = work[0:3], work[3], work[4], work[5]
    power = work[6 : 7 + t]
    rows = work[7 + t :]
    volume, toward, rows = rows[:n], rows[n : 4 * n], rows[4 * n :]
    depth, rows = rows[: indices[HULL]], rows[indices[HULL] :]
    kept, ring = rows[: indices[FACETS]], rows[indices[FACETS] :]
    width = work.shape[1]
    for first in range(0, len(x), width):
        count = min(width, len(x) - first)
        for q in range(width):
            for k in range(3):  # those that are missing repeat the last
                places[k, q] = x[first + min(q, count - 1), k] * numbers[SCALE]
        plain[:] = 1.0
        volume[:] = 0.0
        power[t] = UNKNOWN
        _depths(numbers, indices, places, plain, depth)
        _powers(numbers, indices, places, plain, power)
        _kept_lengths(numbers, indices, power, depth, kept)
        for k in range(3 * n):
            site, here, there = numbers[indices[SITE] + k], places[k % 3], toward[k]
            for q in range(width):
                there[q] = site - here[q]
        edge = indices[EDGE]
        for _ in range(indices[EDGES]):
            _areas(numbers, indices, edge, power, kept, ring, turn, area)
            _add_face(numbers, indices, edge, toward, area, volume)
            edge += 4 + 2 * indices[place(edge + 2)]
        _normalize(indices, toward, volume, plain, area, turn)
        for q in range(count):
            status[first + q] = INSIDE_HULL if plain[q] > 0 else UNSURE
        _write_answer(numbers, indices, volume, weigh, area, out[first : first + count])


@compiled
def _depths(
    numbers: Array, indices: Indices, x: Array, plain: Array, depth: Array
) -> None:
    """Write depths behind the hull's facets; a small one is not plain."""
    plane = indices[PLANE] + 10 * (indices[FACETS] - indices[HULL])
    x0, x1, x2 = x[0], x[1], x[2]
    for k in range(indices[HULL]):
        n = numbers[plane + 10 * k : plane + 10 * k + 9]
        n0, n1, n2, a0, a1, a2 = n[0], n[1], n[2], n[6], n[7], n[8]
        row = depth[k]
        for q in range(len(row)):
            row[q] = n0 * (a0 - x0[q]) + n1 * (a1 - x1[q]) + n2 * (a2 - x2[q])
            plain[q] = plain[q] if row[q] >= CANCELED else 0.0


@compiled
def _powers(
    numbers: Array, indices: Indices, x: Array, plain: Array, power: Array
) -> None:
    """Write the powers of all circumspheres; a small one is not plain."""
    x0, x1, x2 = x[0], x[1], x[2]
    for k in range(indices[TETRAHEDRA]):
        at = indices[CIRCUMCENTER] + 10 * k
        c = numbers[at : at + 10]
        c0, c1, c2, a0, a1, a2 = 2 * c[0], 2 * c[1], 2 * c[2], c[6], c[7], c[8]
        sure, row = c[9], power[k]
        for q in range(len(row)):
            p0, p1, p2 = x0[q] - a0, x1[q] - a1, x2[q] - a2
            row[q] = (c0 - p0) * p0 + (c1 - p1) * p1 + (c2 - p2) * p2
            plain[q] = plain[q] if abs(row[q]) >= sure else 0.0


@compiled
def _kept_lengths(
    numbers: Array, indices: Indices, power: Array, depth: Array, kept: Array
) -> None:
    """Write the kept lengths of all facets."""
    hull = indices[FACETS] - indices[HULL]
    for facet in range(indices[FACETS]):
        ends = indices[FACET_ENDS] + 2 * facet
        behind, row = power[indices[ends]], kept[facet]
        if facet < hull:
            ahead, length = power[indices[ends + 1]], numbers[indices[LENGTH] + facet]
            for q in range(len(row)):
                row[q] = kept_length(length, behind[q], ahead[q])
        else:
            below = depth[facet - hull]
            for q in range(len(row)):
                row[q] = max(behind[q], 0.0) / (2 * below[q])


@compiled
def _areas(
    numbers: Array,
    indices: Indices,
    edge: int,
    power: Array,
    kept: Array,
    ring: Array,
    turn: Array,
    area: Array,
) -> None:
    """Write twice the area on the query's side of the face of an edge.

    The sum starts where the ring does. Where that is on the query's side, the first
    sides follow upon the last, and angles from them to those turn around.
    """
    sides = indices[place(edge + 2)]
    sine = indices[ANGLE] + indices[place(edge + 3)] + 3
    turn[:] = -1.0
    area[:] = 0.0
    for k in range(sides):
        before = power[indices[place(edge + 4 + sides + k)]]
        facet, row = kept[indices[place(edge + 4 + k)]], ring[k]
        for q in range(len(area)):
            turned = turn[q] if before[q] > 0 else 1.0
            turn[q] = turned
            row[q] = facet[q] * turned
    for k in range(sides - 1):
        row = ring[k]
        for m in range(k + 1, sides):
            angle, other = numbers[place(sine + k * (sides - 1) + m - k - 1)], ring[m]
            for q in range(len(area)):
                area[q] += row[q] * other[q] * angle


@compiled
def _add_face(
    numbers: Array,
    indices: Indices,
    edge: int,
    toward: Array,
    area: Array,
    volume: Array,
) -> None:
    """Add what a face contributes to its two sites."""
    angle = indices[ANGLE] + indices[place(edge + 3)]
    i, j = indices[place(edge)], indices[place(edge + 1)]
    u, v, w = numbers[angle], numbers[angle + 1], numbers[angle + 2]
    for mine, other in ((i, j), (j, i)):
        at = mine if indices[METHOD] == LAPLACE else other
        p, r, s, row = (
            toward[3 * at],
            toward[3 * at + 1],
            toward[3 * at + 2],
            volume[mine],
        )
        for q in range(len(area)):
            row[q] += area[q] * (u * p[q] + v * r[q] + w * s[q])
        u, v, w = -u, -v, -w


@compiled
def _normalize(
    indices: Indices,
    toward: Array,
    volume: Array,
    plain: Array,
    total: Array,
    least: Array,
) -> None:
    """Clip coordinates and write one over their sum; a negative one is not plain."""
    total[:] = 0.0
    least[:] = np.inf
    for i in range(indices[SITES]):
        row = volume[i]
        if indices[METHOD] == LAPLACE:
            p, r, s = toward[3 * i], toward[3 * i + 1], toward[3 * i + 2]
            for q in range(len(total)):
                row[q] /= -(p[q] * p[q] + r[q] * r[q] + s[q] * s[q])
        for q in range(len(total)):
            least[q] = min(least[q], row[q])
            row[q] = max(row[q], 0.0)
            total[q] += row[q]
    for q in range(len(total)):
        plain[q] = plain[q] if least[q] >= NEGATIVE * total[q] else 0.0
        total[q] = 1 / total[q]


@compiled
def _write_answer(
    numbers: Array,
    indices: Indices,
    volume: Array,
    weigh: int,
    share: Array,
    out: Array,
) -> None:
    """Write weights, or add up values."""
    if weigh != 0:
        for i in range(indices[SITES]):
            row = volume[i]
            for q in range(len(out)):
                out[q, i] = row[q] * share[q]
        return
    m = indices[VALUES]
    for q in range(len(out)):
        for v in range(m):
            out[q, v] = 0.0
        for i in range(indices[SITES]):
            weight, values = volume[i, q] * share[q], indices[VALUE] + m * i
            for v in range(m):
                out[q, v] += weight * numbers[place(values + v)]
