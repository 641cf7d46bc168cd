"""One frame of control in one call: markers to joint angles to hand to signal.

    c_k = sum_i w_i (Z_ik . q - m_ik) / sum_i w_i (M_ik - m_ik)

with the natural-neighbor weights w of the hand position (for two arms, the midpoint of
both hands), the directions Z and ranges m to M of the points
(T. Lisini Baldi et al., arXiv 2012.03600, section II).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.frame_sequence import FrameMemory, follow_frame
from ikns._kernels.body.marker_gate import THORAX, MarkerGate
from ikns._kernels.body.marker_problem import cut, unpack
from ikns._kernels.body.paths import Paths, place_frames
from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.diagram import NOT_FINITE, OUTSIDE_HULL
from ikns._kernels.voronoi.query import natural_weights
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
    hands: Indices  # (1,) or (2,) the chain's hands, of right and left
    link: Indices  # (M,) link that a marker belongs to, or -1
    need: Indices  # (L,) how many markers of a link must be seen


@compiled
def control_frame(
    whole: Indices,
    real: Array,
    paths: Paths,
    gate: MarkerGate,
    control_map: ControlMap,
    markers: Array,
    from_scratch: bool,
    memory: FrameMemory,
    q: Array,
    work: Array,
    cavity_work: Array,
    rotation: Array,
    position: Array,
    weights: Array,
    place: Array,
    c: Array,
) -> tuple[float, float, float, int, bool, bool, int]:
    """Solve one frame of markers (M, 3) in the world, m; NaN where not seen.

    `whole`, `real`, `gate` and `memory`, which has the pose to start from, are as in
    :func:`ikns._kernels.body.frame_sequence.solve_frames`, `paths` lead to both hands;
    `work`, `cavity_work`, `rotation` (1, 2, 3, 3) and `weights` (P,) are scratch.
    Written are the pose `q` (nq,), the right and left hand `position` (1, 2, 3) and the
    task's `place` (3,) in the thorax frame, m, and the signals `c` (d,), not clipped:
    NaN while the chain is not in sight, and where the weights are NaN or the range is
    zero.

    Returns
    -------
    residual : float
        As from marker inverse kinematics, like `iterations` and `converged`.
    worst : float
        Largest residual of a marker on the chain's links, m; NaN without any.
    intermarker : float
        Largest error of a distance between two markers of a link, m; 0 where no pair is
        seen.
    iterations : int
    converged : bool
    known : bool
        Whether the chain is in sight.
    status : int
        Of the hand position, from
        :func:`ikns._kernels.voronoi.query.natural_weights`.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    figures, passed = np.empty((2, 3)), np.empty(2, dtype=np.bool_)
    residual, iterations, converged = follow_frame(
        problem,
        s,
        gate,
        markers,
        memory,
        from_scratch,
        q,
        figures[0],
        figures[1],
        passed,
    )
    worst, intermarker = figures[0, THORAX], figures[1, THORAX]
    for hand in control_map.hands:
        # The first is NaN where nothing of the thorax is seen.
        if not worst >= figures[0, 1 + hand]:
            worst = figures[0, 1 + hand]
        intermarker = max(intermarker, figures[1, 1 + hand])
    known = _in_sight(markers, control_map.link, control_map.need)
    n_angles = len(q) - 7
    place_frames(paths, q[7:].reshape(1, n_angles), rotation, position)
    hands = control_map.hands
    for k in range(3):
        place[k] = 0.0
        for h in range(len(hands)):
            place[k] += position[0, hands[h], k]
        place[k] /= len(hands)
    for k in range(len(c)):
        c[k] = np.nan
    if not known:
        return residual, worst, intermarker, iterations, converged, known, NOT_FINITE
    if len(control_map.indices):
        status = natural_weights(
            control_map.numbers, control_map.indices, place, cavity_work, weights
        )
    else:
        status = _nearest_weights(control_map.points, place, weights)
    _signals(
        weights,
        control_map.directions,
        control_map.lower,
        control_map.upper,
        control_map.columns,
        q[7:],
        c,
    )
    return residual, worst, intermarker, iterations, converged, known, status


@compiled
def _in_sight(markers: Array, link: Indices, need: Indices) -> bool:
    for i in range(len(need)):
        seen = 0
        for m in range(len(link)):
            total = markers[m, 0] + markers[m, 1] + markers[m, 2]
            if link[m] == i and np.isfinite(total):
                seen += 1
        if seen < need[i]:
            return False
    return True


@compiled
def _nearest_weights(points: Array, place: Array, weights: Array) -> int:
    nearest, least = 0, np.inf
    for i in range(len(points)):
        square = 0.0
        for k in range(3):
            square += (points[i, k] - place[k]) ** 2
        weights[i] = 0.0
        if square < least:
            nearest, least = i, square
    weights[nearest] = 1.0
    return OUTSIDE_HULL


@compiled
def _signals(
    weights: Array,
    directions: Array,
    lower: Array,
    upper: Array,
    columns: Indices,
    angles: Array,
    c: Array,
) -> None:
    for k in range(len(c)):
        above = width = 0.0
        for i in range(len(weights)):
            local = -lower[i, k]
            for j in range(len(columns)):
                local += directions[i, k, j] * angles[columns[j]]
            above += weights[i] * local
            width += weights[i] * (upper[i, k] - lower[i, k])
        if width > 0:
            c[k] = above / width
