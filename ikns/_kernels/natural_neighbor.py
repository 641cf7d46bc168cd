"""One query for natural neighbors: from where it is to weights of the sites or a value.

The query is scaled and brought near, placed in or on the hull by the rule for queries
outside it, moved away from the hull by a skin, and given its coordinates (`cavity`,
`sibson`). A query whose coordinates cannot be trusted is `UNSURE`; the caller asks the
slow reference, ikns.interpolation.reference, which holds the reasons for each step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.cavity import all_powers, cavity, forget_cavity
from ikns._kernels.compiled import compiled
from ikns._kernels.diagram import (
    CENTER,
    EDGES,
    INSIDE_HULL,
    LAPLACE,
    LISTS,
    METHOD,
    NEAREST,
    NOT_FINITE,
    NOWHERE,
    OUTSIDE,
    OUTSIDE_HULL,
    ROUNDING,
    SCALE,
    SITE,
    SITES,
    TOWARD,
    UNSURE,
    VALUE,
    VALUES,
    VOLUME,
    WALK,
)
from ikns._kernels.hull import hull_depths
from ikns._kernels.hull_projection import nearest_on_hull
from ikns._kernels.sibson import add_edge, face_site
from ikns._kernels.twofold import Triple, difference

__all__ = [
    "AT_SITE",
    "FAR",
    "NEGATIVE",
    "SKIN",
    "interpolate_many",
    "interpolate_one",
    "natural_weights",
    "weigh_many",
]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Queries nearer to the hull than this part of the way to the middle are moved in to
#: there. The hull of a box whose corners are rounded is uneven by 1e-16, and this near
#: to it weights would tell which way.
SKIN = 1e-11
#: Queries farther out are brought this near: only their direction matters there.
FAR = 1e9
#: Squared distance to a site below which nothing could be told apart.
AT_SITE = 1e-36
#: A weight below this is wrong: rounding leaves -1e-15.
NEGATIVE = -1e-9


@compiled
def _scaled(numbers: Floats, x: Triple) -> Triple:
    y = (x[0] * numbers[SCALE], x[1] * numbers[SCALE], x[2] * numbers[SCALE])
    a = y[0] - numbers[CENTER]
    b = y[1] - numbers[CENTER + 1]
    c = y[2] - numbers[CENTER + 2]
    reach = max(abs(a), abs(b), abs(c))
    if reach > FAR:
        y = (
            numbers[CENTER] + a / reach * FAR,
            numbers[CENTER + 1] + b / reach * FAR,
            numbers[CENTER + 2] + c / reach * FAR,
        )
    return y


@compiled
def _nearest(numbers: Floats, indices: Indices, x: Triple) -> tuple[int, float]:
    """Return the nearest site and the square of its distance."""
    nearest, least = 0, np.inf
    for i in range(indices[SITES]):
        at = indices[SITE] + 3 * i
        p, q, r = numbers[at] - x[0], numbers[at + 1] - x[1], numbers[at + 2] - x[2]
        square = p * p + q * q + r * r
        if square < least:
            nearest, least = i, square
    return nearest, least


@compiled
def _moved_in(numbers: Floats, x: Triple, part: float) -> tuple[Triple, Triple]:
    """Move a point from a part of the way to the middle to the skin, twofold."""
    step = (SKIN - part) / (1 - part)
    p, p_rest = difference(x[0], step * (x[0] - numbers[CENTER]))
    q, q_rest = difference(x[1], step * (x[1] - numbers[CENTER + 1]))
    r, r_rest = difference(x[2], step * (x[2] - numbers[CENTER + 2]))
    return (p, q, r), (p_rest, q_rest, r_rest)


@compiled
def _one_site(indices: Indices, site: int, work: Floats) -> int:
    """Give a site all the weight."""
    work[indices[VOLUME] + site] = 1.0
    if indices[WALK] < 0:
        return indices[SITES]
    work[indices[LISTS] :].view(np.int64)[3] = site
    return 1


@compiled
def _normalized(indices: Indices, count: int, work: Floats) -> bool:
    """Divide coordinates by their sum; say whether they can be weights."""
    volume, walks = indices[VOLUME], indices[WALK] >= 0
    lists = work[indices[LISTS] :].view(np.int64)
    total = 0.0
    for k in range(count):
        i = lists[3 + k] if walks else k
        if indices[METHOD] == LAPLACE:
            at = indices[TOWARD] + 3 * i
            p, q, r = work[at], work[at + 1], work[at + 2]
            work[volume + i] /= p * p + q * q + r * r
        total += work[volume + i]
    least = np.inf
    for k in range(count):
        i = lists[3 + k] if walks else k
        weight = work[volume + i] / total
        if not weight >= least:
            least = weight
        work[volume + i] = max(weight, 0.0)
    if not least >= NEGATIVE:
        return False
    total = 0.0
    for k in range(count):
        total += work[volume + (lists[3 + k] if walks else k)]
    for k in range(count):
        work[volume + (lists[3 + k] if walks else k)] /= total
    return True


@compiled
def _cut(
    numbers: Floats,
    indices: Indices,
    x: Triple,
    rest: Triple,
    start: int,
    work: Floats,
) -> tuple[int, int]:
    """Write the weights of a point inside; return a status and how many there are."""
    n = indices[SITES]
    if indices[WALK] < 0:
        for i in range(n):
            if face_site(numbers, indices, i, x, work) <= AT_SITE:
                return INSIDE_HULL, _one_site(indices, i, work)
        all_powers(numbers, indices, x, rest, work)
        for edge in range(indices[EDGES]):
            add_edge(numbers, indices, edge, work)
        return (INSIDE_HULL if _normalized(indices, n, work) else UNSURE), n

    corners, edges, sites = cavity(numbers, indices, x, rest, start, work)
    if corners == 0:
        nearest, square = _nearest(numbers, indices, x)
        if square <= AT_SITE:
            return INSIDE_HULL, _one_site(indices, nearest, work)
        return UNSURE, 0
    lists = work[indices[LISTS] :].view(np.int64)
    lists[0] = lists[3 + n + indices[EDGES]]
    at_site = -1
    for k in range(sites):
        if face_site(numbers, indices, lists[3 + k], x, work) <= AT_SITE:
            at_site = lists[3 + k]
    if at_site < 0:
        for k in range(edges):
            add_edge(numbers, indices, lists[3 + n + k], work)
    forget_cavity(indices, corners, edges, sites, work)
    if at_site >= 0:
        return INSIDE_HULL, _one_site(indices, at_site, work)
    return (INSIDE_HULL if _normalized(indices, sites, work) else UNSURE), sites


@compiled
def _weights(
    numbers: Floats, indices: Indices, x: Triple, start: int, work: Floats
) -> tuple[int, int]:
    """Write the weights of any query; return its status and how many there are."""
    y = _scaled(numbers, x)
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
    if part < SKIN:
        nearest, square = _nearest(numbers, indices, y)
        if square <= AT_SITE:
            return status, _one_site(indices, nearest, work)
        y, rest = _moved_in(numbers, y, part)
        hull_depths(numbers, indices, y, rest, work)
    found, count = _cut(numbers, indices, y, rest, start, work)
    return (UNSURE if found == UNSURE else status), count


@compiled
def _spread(
    indices: Indices, status: int, count: int, work: Floats, weights: Floats
) -> None:
    """Move weights from scratch to an (N,) array."""
    volume, walks = indices[VOLUME], indices[WALK] >= 0
    unknown = status < 0 or count == 0
    for i in range(indices[SITES]):
        weights[i] = np.nan if unknown else 0.0
    lists = work[indices[LISTS] :].view(np.int64)
    for k in range(count):
        i = lists[3 + k] if walks else k
        if not unknown:
            weights[i] = work[volume + i]
        work[volume + i] = 0.0


@compiled
def _blend(
    numbers: Floats,
    indices: Indices,
    status: int,
    count: int,
    work: Floats,
    out: Floats,
) -> None:
    """Add up the sites' values with the weights in scratch."""
    volume, walks, m = indices[VOLUME], indices[WALK] >= 0, indices[VALUES]
    unknown = status < 0 or count == 0
    for v in range(m):
        out[v] = np.nan if unknown else 0.0
    lists = work[indices[LISTS] :].view(np.int64)
    for k in range(count):
        i = lists[3 + k] if walks else k
        weight, values = work[volume + i], indices[VALUE] + m * i
        work[volume + i] = 0.0
        if weight != 0:
            for v in range(m):
                out[v] += weight * numbers[values + v]


@compiled
def natural_weights(
    numbers: Floats, indices: Indices, x: Floats, work: Floats, weights: Floats
) -> int:
    """Weights of the sites at one query.

    Parameters
    ----------
    numbers, indices : arrays
        The packed diagram.
    x : (3,) array
        Query, m.
    work : array
        Scratch memory of this thread, from `new_work`.
    weights : (N,) array
        Where the weights go; NaN where there are none.

    Returns
    -------
    int
        INSIDE_HULL, OUTSIDE_HULL, NOT_FINITE or UNSURE.
    """
    at = (x[0], x[1], x[2])
    status, count = _weights(numbers, indices, at, indices[WALK], work)
    _spread(indices, status, count, work, weights)
    return status


@compiled
def interpolate_one(
    numbers: Floats,
    indices: Indices,
    x: float,
    y: float,
    z: float,
    work: Floats,
    out: Floats,
) -> int:
    """Write the value (M,) at one query, m; return its status."""
    status, count = _weights(numbers, indices, (x, y, z), indices[WALK], work)
    _blend(numbers, indices, status, count, work, out)
    return status


@compiled
def weigh_many(
    numbers: Floats,
    indices: Indices,
    x: Floats,
    order: Indices,
    work: Floats,
    weights: Floats,
    status: Indices,
) -> None:
    """Write the weights (Q, N) and the status (Q,) of queries (Q, 3), one by one."""
    start = indices[WALK]
    lists = work[indices[LISTS] :].view(np.int64)
    lists[0] = start
    for q in order:
        at = (x[q, 0], x[q, 1], x[q, 2])
        status[q], count = _weights(numbers, indices, at, lists[0], work)
        _spread(indices, status[q], count, work, weights[q])


@compiled
def interpolate_many(
    numbers: Floats,
    indices: Indices,
    x: Floats,
    order: Indices,
    work: Floats,
    out: Floats,
    status: Indices,
) -> None:
    """Write the values (Q, M) and the status (Q,) of queries (Q, 3), one by one."""
    start = indices[WALK]
    lists = work[indices[LISTS] :].view(np.int64)
    lists[0] = start
    for q in order:
        at = (x[q, 0], x[q, 1], x[q, 2])
        status[q], count = _weights(numbers, indices, at, lists[0], work)
        _blend(numbers, indices, status[q], count, work, out[q])
