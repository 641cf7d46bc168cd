"""Whether the markers of a frame can be believed: three figures against three limits.

Of the whole body the root mean square residual; of the thorax and of each limb the
largest residual of a marker, and the largest error of a distance between two markers of
the same segment.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.marker_problem import Scratch
from ikns._kernels.compiled import inner_borrowing
from ikns.arrays import Array, Indices

#: Entries of figures by group: the thorax, then the limbs.
THORAX = 0


class MarkerGate(NamedTuple):
    """M markers and N pairs of markers of the same segment."""

    group: Indices  # (M,) 0 for the thorax, 1, 2 for a limb, -1 for none
    pair: Indices  # (N, 2) columns of markers
    apart: Array  # (N,) their distance on the person, m
    pair_group: Indices  # (N,)
    limits: Array  # (3,) residual, worst residual, intermarker error, m


def pack_gate(gate: MarkerGate) -> tuple[Indices, Array]:
    """Pack a gate into integers and reals."""
    return (
        np.concatenate([gate.pair.ravel(), gate.pair_group, gate.group]),
        np.concatenate([gate.limits, gate.apart]),
    )


@inner_borrowing
def unpack_gate(whole: Indices, real: Array) -> MarkerGate:
    """Unpack it, for a kernel that borrows its arrays, too."""
    n = len(real) - 3
    return MarkerGate(
        whole[3 * n :], whole[: 2 * n].reshape(n, 2), real[3:], whole[2 * n : 3 * n],
        real[:3],
    )  # fmt: skip


@inner_borrowing
def gate_figures(s: Scratch, gate: MarkerGate, markers: Array) -> None:
    """Write the figures of markers whose errors are in `s` by group, (G,) m, into `s`.

    The worst residual is NaN where no marker of the group is seen, the intermarker
    error 0 where no pair is.
    """
    worst, intermarker = s.worst, s.intermarker
    for g in range(len(worst)):
        worst[g], intermarker[g] = -1.0, 0.0
    for m in range(len(gate.group)):
        g = gate.group[m]
        if g >= 0 and s.weight[m] > 0:
            square = 0.0
            for k in range(3):
                square += s.error[m, k] ** 2
            worst[g] = max(worst[g], square)
    for g in range(len(worst)):
        worst[g] = np.sqrt(worst[g]) if worst[g] >= 0 else np.nan
    for i in range(len(gate.pair)):
        square = total = 0.0
        for k in range(3):
            first, second = markers[gate.pair[i, 0], k], markers[gate.pair[i, 1], k]
            total += abs(first) + abs(second)
            square += (first - second) ** 2
        if np.isfinite(total):
            g = gate.pair_group[i]
            error = abs(np.sqrt(square) - gate.apart[i])
            intermarker[g] = max(intermarker[g], error)


@inner_borrowing
def fits(s: Scratch, gate: MarkerGate, residual: float) -> bool:
    """Write whether each limb with the thorax is within the limits; return if all are.

    The figures are in `s`. What was not seen has none and disproves nothing.
    """
    every = True
    for limb in range(len(s.passed)):
        within = not residual > gate.limits[0]
        for g in (THORAX, 1 + limb):
            within = within and not s.worst[g] > gate.limits[1]
            within = within and not s.intermarker[g] > gate.limits[2]
        s.passed[limb] = 1.0 if within else 0.0
        every = every and within
    return every
