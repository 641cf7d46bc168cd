"""One natural-neighbor query: from its position to weights of the sites or a value.

The query is scaled and brought near, projected onto the hull if it is outside and that
is the rule, moved away from the hull by a skin, and given its coordinates (`cavity`,
`sibson`). A query whose coordinates cannot be trusted, for the walk to it failed or a
weight came out negative, is `UNSURE` and has NaN for weights and value.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.answer import write_answer
from ikns._kernels.voronoi.cavity import check_all_spheres, clear_cavity, find_cavity
from ikns._kernels.voronoi.diagram import (
    CENTER,
    INSIDE_HULL,
    LAPLACE,
    METHOD,
    MIDDLE,
    NEAREST,
    NEIGHBORS,
    NOT_FINITE,
    NOWHERE,
    OFFSET,
    OUTSIDE,
    OUTSIDE_HULL,
    ROUNDING,
    SITE,
    SITES,
    START,
    UNSURE,
    VOLUME,
    place,
)
from ikns._kernels.voronoi.double_double import Triple, difference
from ikns._kernels.voronoi.hull import hull_depths, scaled
from ikns._kernels.voronoi.hull_projection import nearest_on_hull
from ikns._kernels.voronoi.sibson import add_faces
from ikns.arrays import Array, Indices

#: Queries closer to the hull than this part of the way to the middle are moved in to
#: there. The hull of a box whose corners are rounded is uneven by 1e-16, and closer to
#: it the weights would depend on how.
_SKIN = 1e-11
#: Squared distance to a site below which nothing could be told apart.
_AT_SITE = 1e-36
#: A weight below this is wrong: rounding leaves -1e-15.
NEGATIVE = -1e-9


@compiled
def _nearest(numbers: Array, indices: Indices, x: Triple) -> tuple[int, float]:
    """Return the nearest site and the square of its distance."""
    nearest, least = 0, np.inf
    for i in range(indices[SITES]):
        at = place(indices[SITE] + 3 * i)
        p = numbers[at] - x[0]
        q = numbers[at + place(1)] - x[1]
        r = numbers[at + place(2)] - x[2]
        square = p * p + q * q + r * r
        if square < least:
            nearest, least = i, square
    return nearest, least


@compiled
def _one_site(indices: Indices, site: int, work: Array) -> int:
    """Give a site all the weight."""
    work[place(indices[VOLUME] + site)] = 1.0
    work[indices[NEIGHBORS] :].view(np.int64)[0] = site
    return 1


@compiled
def _inside_weights(
    numbers: Array, indices: Indices, x: Triple, rest: Triple, start: int, work: Array
) -> tuple[bool, int]:
    """Write the weights of a point inside; return whether they are, and how many."""
    if start < 0:
        tetrahedra, sites = check_all_spheres(numbers, indices, x, rest, work)
    else:
        tetrahedra, sites = find_cavity(numbers, indices, x, rest, start, work)
    if tetrahedra == 0:
        nearest, square = _nearest(numbers, indices, x)
        if square <= _AT_SITE:
            return True, _one_site(indices, nearest, work)
        return False, 0
    neighbors = work[indices[NEIGHBORS] :].view(np.int64)
    offset, volume, at_site = indices[OFFSET], indices[VOLUME], -1
    for k in range(sites):
        site = neighbors[place(k)]
        at, to = place(indices[SITE] + 3 * site), place(offset + 3 * site)
        p = numbers[at] - x[0]
        q = numbers[at + place(1)] - x[1]
        r = numbers[at + place(2)] - x[2]
        work[to], work[to + place(1)], work[to + place(2)] = p, q, r
        if p * p + q * q + r * r <= _AT_SITE:
            at_site = site
    if at_site < 0:
        add_faces(numbers, indices, tetrahedra, work)
    if start >= 0:
        clear_cavity(indices, tetrahedra, sites, work)
    if at_site >= 0:
        return True, _one_site(indices, at_site, work)

    total, positive, least = 0.0, 0.0, np.inf
    for k in range(sites):
        site = neighbors[place(k)]
        weight = work[place(volume + site)]
        if indices[METHOD] == LAPLACE:
            to = place(offset + 3 * site)
            p, q, r = work[to], work[to + place(1)], work[to + place(2)]
            weight /= p * p + q * q + r * r
        total += weight
        least = min(least, weight)
        positive += max(weight, 0.0)
        work[place(volume + site)] = max(weight, 0.0)
    for k in range(sites):
        work[place(volume + neighbors[place(k)])] /= positive
    return least >= NEGATIVE * total and total > 0, sites


@compiled
def _weights(
    numbers: Array, indices: Indices, x: Triple, start: int, work: Array
) -> tuple[int, int]:
    """Write the weights of any query; return its status and how many there are."""
    y = scaled(numbers, x)
    if not (np.isfinite(y[0]) and np.isfinite(y[1]) and np.isfinite(y[2])):
        return NOT_FINITE, 0
    rest = (0.0, 0.0, 0.0)
    least, part = hull_depths(numbers, indices, y, rest, work)
    status = INSIDE_HULL
    if least < -numbers[ROUNDING]:
        status = OUTSIDE_HULL
        if indices[OUTSIDE] == NOWHERE:
            return status, 0
        if indices[OUTSIDE] == NEAREST:
            nearest, _ = _nearest(numbers, indices, y)
            return status, _one_site(indices, nearest, work)
        y = nearest_on_hull(numbers, indices, y)
        least, part = hull_depths(numbers, indices, y, rest, work)
    if part < _SKIN:
        nearest, square = _nearest(numbers, indices, y)
        if square <= _AT_SITE:
            return status, _one_site(indices, nearest, work)
        step = (_SKIN - part) / (1 - part)
        p, p_rest = difference(y[0], step * (y[0] - numbers[CENTER]))
        q, q_rest = difference(y[1], step * (y[1] - numbers[CENTER + 1]))
        r, r_rest = difference(y[2], step * (y[2] - numbers[CENTER + 2]))
        y, rest = (p, q, r), (p_rest, q_rest, r_rest)
        hull_depths(numbers, indices, y, rest, work)
    sure, count = _inside_weights(numbers, indices, y, rest, start, work)
    return (status if sure else UNSURE), count


@compiled
def answer_one(diagram: Array, x: Array, out: Array) -> bool:
    """Write the value (M,) at a query (3,), m; return whether it has three numbers."""
    if len(x) != 3:
        return False
    indices, at = diagram.view(np.int64), (x[0], x[1], x[2])
    status, count = _weights(diagram, indices, at, indices[MIDDLE], diagram)
    write_answer(diagram, indices, status, count, diagram, 0, out)
    return True


@compiled
def answer_many(
    diagram: Array, x: Array, order: Indices, weigh: int, out: Array, status: Indices
) -> None:
    """Write weights (Q, N) or values (Q, M) and the status (Q,) of queries (Q, 3).

    Only of those in `order`; each walk starts where the one before ended.
    """
    indices = diagram.view(np.int64)
    indices[indices[START]] = indices[MIDDLE]
    for q in order:
        start, at = indices[indices[START]], (x[q, 0], x[q, 1], x[q, 2])
        status[q], count = _weights(diagram, indices, at, start, diagram)
        write_answer(diagram, indices, status[q], count, diagram, weigh, out[q])


@compiled
def natural_weights(
    numbers: Array, indices: Indices, x: Array, work: Array, weights: Array
) -> int:
    """Write the weights (N,) of the sites at a query (3,), m; NaN where there are none.

    The packed diagram is read as floats and as integers; `work` is this thread's
    scratch memory, from `new_work`. Returns INSIDE_HULL, OUTSIDE_HULL, NOT_FINITE or
    UNSURE.
    """
    at = (x[0], x[1], x[2])
    status, count = _weights(numbers, indices, at, indices[MIDDLE], work)
    write_answer(numbers, indices, status, count, work, 1, weights)
    return status
