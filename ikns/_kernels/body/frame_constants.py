"""What does not change between frames, besides the body, as two arrays.

As with :mod:`ikns._kernels.body.marker_problem`: handing over an array from Python
takes a quarter of a microsecond, a frame some forty, and these are thirty arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.marker_gate import MarkerGate
from ikns._kernels.body.paths import Paths
from ikns._kernels.body.uncertainty import Segments
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array, Indices


class ControlMap(NamedTuple):
    """P points for d signals of n joints, seen by M markers on L links."""

    points: Array  # (P, 3) m; without natural neighbors the nearest has all the weight
    numbers: Array  # a packed interpolator, as floats
    indices: Indices  # the same as integers; empty where there is none
    directions: Array  # (P, d, n)
    lower: Array  # (P, d) rad
    upper: Array  # (P, d) rad
    columns: Indices  # (n,) the chain's joints among the angles
    sides: Indices  # (1,) or (2,) the chain's, 0 right and 1 left
    ends: Indices  # (E,) the chain's ends among the paths
    link: Indices  # (M,) link that a marker belongs to, or -1
    need: Indices  # (L,) how many markers of a link must be seen


class IntentNumbers(NamedTuple):
    """Constants of :func:`ikns._kernels.body.intent_signal.intent_signal`."""

    paths: Paths
    numbers: Array  # empty where the map above is what reads the signal
    leverage: Array  # (10, 10) or empty


class FrameConstants(NamedTuple):
    """What a frame takes besides the packed marker problem."""

    paths: Paths  # to both hands, or to other ends of the chain
    gate: MarkerGate
    control_map: ControlMap
    intent: IntentNumbers
    segments: Segments


def pack_constants(constants: FrameConstants) -> tuple[Indices, Array]:
    """Pack into integers and reals, in the order of `unpack_constants`."""
    paths, gate, learned, intent, segments = constants
    P, d, n = learned.directions.shape
    header = [
        *(len(each.ends) for each in (paths, intent.paths)),
        *(len(each.joint) for each in (paths, intent.paths)),
        len(gate.group), len(gate.pair), P, d, n,
        len(learned.numbers), len(learned.indices), len(learned.sides),
        len(learned.need), len(segments.speed), len(intent.numbers),
        len(intent.leverage), segments.total, len(learned.ends),
    ]  # fmt: skip
    whole = [
        np.array(header), paths.ends, paths.joint, intent.paths.ends,
        intent.paths.joint, gate.group, gate.pair, gate.pair_group, learned.indices,
        learned.columns, learned.sides, learned.ends, learned.link, learned.need,
        segments.of_marker, segments.of_joint,
    ]  # fmt: skip
    real = [
        paths.rotation, paths.translation, intent.paths.rotation,
        intent.paths.translation, gate.apart, gate.limits, learned.points,
        learned.numbers, learned.directions, learned.lower, learned.upper,
        intent.numbers, intent.leverage, segments.speed,
    ]  # fmt: skip
    return (
        np.concatenate([np.ravel(part) for part in whole]).astype(np.int64),
        np.concatenate([np.ravel(part) for part in real]).astype(np.float64),
    )


@inner_borrowing
def unpack_constants(whole: Indices, real: Array) -> FrameConstants:
    """Unpack them, for a kernel that borrows its arrays, too."""
    E, F, K, L = whole[0], whole[1], whole[2], whole[3]
    M, N, P, d, n = whole[4], whole[5], whole[6], whole[7], whole[8]
    size, count, sides, links = whole[9], whole[10], whole[11], whole[12]
    dofs, own, leverage = whole[13], whole[14], whole[15]
    a = 18
    b = a + E + 3 * K
    c = b + F + 3 * L
    e = c + M + 2 * N
    f = e + N
    g = f + count
    h = g + n
    o = h + sides
    i = o + whole[17]
    j = i + M
    k = j + links
    r = 12 * (K + E)
    s = r + 12 * (L + F)
    t = s + N + 3
    u = t + 3 * P
    v = u + size
    w = v + P * d * n
    x = w + 2 * P * d
    y = x + own
    z = y + leverage**2
    return FrameConstants(
        _paths(whole, real, a, 0, E, K),
        MarkerGate(
            whole[c : c + M],
            whole[c + M : e].reshape(N, 2),
            real[s : s + N],
            whole[e:f],
            real[s + N : t],
        ),
        ControlMap(
            real[t:u].reshape(P, 3),
            real[u:v],
            whole[f:g],
            real[v:w].reshape(P, d, n),
            real[w : w + P * d].reshape(P, d),
            real[w + P * d : x].reshape(P, d),
            whole[g:h],
            whole[h:o],
            whole[o:i],
            whole[i:j],
            whole[j:k],
        ),
        IntentNumbers(
            _paths(whole, real, b, r, F, L),
            real[x:y],
            real[y:z].reshape(leverage, leverage),
        ),
        Segments(
            whole[k : k + M],
            whole[k + M : k + M + 2 * dofs].reshape(dofs, 2),
            real[z : z + dofs],
            whole[16],
        ),
    )


@borrowing
def _paths(whole: Indices, real: Array, a: int, r: int, E: int, K: int) -> Paths:
    turned = r + 9 * (K + E)
    return Paths(
        whole[a : a + E],
        whole[a + E : a + E + 3 * K].reshape(K, 3),
        real[r:turned].reshape(K + E, 3, 3),
        real[turned : turned + 3 * (K + E)].reshape(K + E, 3),
    )
