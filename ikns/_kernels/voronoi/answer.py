"""From the weights of a query's natural neighbors to what was asked: weights or values.

Sibson's smooth interpolant joins his weights w_i and the tangent planes at the sites,
with p_i = site - query (R. Sibson, A brief description of natural neighbour
interpolation, 1981):

    Z0 = sum_i w_i z_i
    xi = sum_i w_i / |p_i| (z_i - gradient_i . p_i) / sum_i w_i / |p_i|
    alpha = sum_i w_i |p_i| / sum_i w_i / |p_i|,    beta = sum_i w_i |p_i|^2
    Z1 = (alpha Z0 + beta xi) / (alpha + beta)
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled, inner
from ikns._kernels.voronoi.diagram import (
    GRADIENT,
    METHOD,
    NEIGHBORS,
    OFFSET,
    SMOOTH,
    VALUE,
    VALUES,
    VOLUME,
    place,
)
from ikns.arrays import Array, Indices


@compiled
def _smooth_coefficients(
    indices: Indices, count: int, work: Array
) -> tuple[float, float]:
    """Return a, b in Z1 = sum_i a w_i z_i + b w_i / |p_i| (z_i - gradient_i . p_i)."""
    volume, offset = indices[VOLUME], indices[OFFSET]
    neighbors = work[indices[NEIGHBORS] :].view(np.int64)
    nearness, distance, square = 0.0, 0.0, 0.0
    for k in range(count):
        site = neighbors[place(k)]
        to, weight = place(offset + 3 * site), work[place(volume + site)]
        p, q, r = work[to], work[to + place(1)], work[to + place(2)]
        length = np.sqrt(p * p + q * q + r * r)
        nearness += weight / length
        distance += weight * length
        square += weight * length * length
    alpha = distance / nearness
    return alpha / (alpha + square), square / (alpha + square) / nearness


@inner
def write_answer(
    numbers: Array,
    indices: Indices,
    status: int,
    count: int,
    work: Array,
    weigh: int,
    out: Array,
) -> None:
    """Move weights from scratch to an (N,) array, or add up the sites' values (M,)."""
    volume, offset, m = indices[VOLUME], indices[OFFSET], indices[VALUES]
    known = status >= 0 and count > 0
    for v in range(len(out)):
        out[v] = 0.0 if known else np.nan
    smooth = indices[METHOD] == SMOOTH and count > 1 and weigh == 0
    plain, tangent = 1.0, 0.0
    if smooth:
        plain, tangent = _smooth_coefficients(indices, count, work)
    neighbors = work[indices[NEIGHBORS] :].view(np.int64)
    for k in range(count):
        site = neighbors[place(k)]
        weight = work[place(volume + site)]
        work[place(volume + site)] = 0.0
        if not known or weight == 0:
            continue
        if weigh != 0:
            out[site] = weight
            continue
        steep = 0.0
        if smooth:
            to = place(offset + 3 * site)
            p, q, r = work[to], work[to + place(1)], work[to + place(2)]
            steep = tangent * weight / np.sqrt(p * p + q * q + r * r)
            gradients = indices[GRADIENT] + 3 * m * site
            for v in range(m):
                g = place(gradients + 3 * v)
                out[v] -= steep * (
                    numbers[g] * p
                    + numbers[g + place(1)] * q
                    + numbers[g + place(2)] * r
                )
        weight = plain * weight + steep
        values = indices[VALUE] + m * site
        for v in range(m):
            out[v] += weight * numbers[place(values + v)]
