"""One frame of control in one call: markers to joint angles to hand to signal.

    c_k = sum_i w_i (Z_ik . q - m_ik) / sum_i w_i (M_ik - m_ik)

with the natural-neighbor weights w of the hand position (for two arms, the midpoint of
both hands), the directions Z and ranges m to M of the points
(T. Lisini Baldi et al., arXiv 2012.03600, section II); or the signal of the method
intent. And how uncertain the signal is, from :mod:`ikns._kernels.body.uncertainty`.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.descent import errors_at
from ikns._kernels.body.frame_constants import (
    ControlMap,
    FrameConstants,
    IntentNumbers,
    unpack_constants,
)
from ikns._kernels.body.frame_sequence import cut_memory, follow_frame
from ikns._kernels.body.intent_gradient import intent_gradient
from ikns._kernels.body.intent_signal import LEASH, intent_signal
from ikns._kernels.body.marker_errors import take_markers
from ikns._kernels.body.marker_gate import THORAX
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch, cut, unpack
from ikns._kernels.body.paths import Paths, follow_path, place_frames
from ikns._kernels.body.uncertainty import deviation, factor_information, note_markers
from ikns._kernels.compiled import borrowing, compiled
from ikns._kernels.voronoi.diagram import INSIDE_HULL, NOT_FINITE, OUTSIDE_HULL
from ikns._kernels.voronoi.query import natural_weights
from ikns.arrays import Array, Indices, Mask

#: Error of the hand's place with markers hidden, m, over which c's slope is taken: with
#: the nearest point outside the hull, c steps there.
REACH = 5e-3
#: Standard deviation above which that slope is looked at; it takes a fifth of a frame.
DOUBTFUL = 0.0125


@borrowing
def control_frame(
    whole: Indices,
    real: Array,
    whole_constants: Indices,
    real_constants: Array,
    markers: Array,
    dt: float,
    from_scratch: bool,
    memory: Array,
    seen_before: Array,
    q: Array,
    work: Array,
    cavity_work: Array,
    rotation: Array,
    position: Array,
    weights: Array,
    place: Array,
    c: Array,
    deviations: Array,
) -> tuple[float, float, float, int, bool, bool, int]:
    """Solve one frame of markers (M, 3) in the world, m; NaN where not seen.

    `whole`, `real` and `memory`, which has the pose to start from, are as in
    :func:`ikns._kernels.body.frame_sequence.solve_frames`, the constants packed
    :class:`ikns._kernels.body.frame_constants.FrameConstants`;
    `seen_before` (M + 2, 5) is the memory of markers of
    :mod:`ikns._kernels.body.uncertainty` and, in two rows more, that of the hand of
    :mod:`ikns._kernels.body.intent_signal`; `dt` the time since the frame before, s;
    `work`, `cavity_work`, `rotation` (1, E, 3, 3), for E of at least 2, and `weights`
    (P,) are scratch. Written are the pose `q` (nq,), the right and left hand's (or the
    chain's ends') `position` (1, E, 3) and the task's `place` (3,) in the thorax frame
    (or the chain's base), m, the signals `c` (d,), not clipped, and their standard
    `deviations` (d,): NaN where the weights are NaN or the range is zero, and without a
    marker.

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
    in_sight : bool
        Whether every segment of the chain is.
    status : int
        Of the hand position, from
        :func:`ikns._kernels.voronoi.query.natural_weights`; with intent, of the wrist.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    constants = unpack_constants(whole_constants, real_constants)
    gate, control_map = constants.gate, constants.control_map
    known = cut_memory(memory, problem.n_branches)
    residual, iterations, converged = follow_frame(
        problem, s, gate, markers, known, from_scratch, q
    )
    worst, intermarker = s.worst[THORAX], s.intermarker[THORAX]
    believed = True
    for side in control_map.sides:
        # The first is NaN where nothing of the thorax is seen.
        if not worst >= s.worst[1 + side]:
            worst = s.worst[1 + side]
        intermarker = max(intermarker, s.intermarker[1 + side])
        believed = believed and s.passed[side] > 0
    seen = _in_sight(markers, control_map.link, control_map.need)
    status = _read_pose(
        problem, s, constants, q, dt, believed, seen_before, np.isfinite(residual),
        cavity_work, rotation, position, weights, place, c, deviations,
    )  # fmt: skip
    return residual, worst, intermarker, iterations, converged, seen, status


@borrowing
def recorded_signals(
    whole: Indices,
    real: Array,
    whole_constants: Indices,
    real_constants: Array,
    markers: Array,
    dt: Array,
    believed: Mask,
    seen_before: Array,
    q: Array,
    work: Array,
    cavity_work: Array,
    rotation: Array,
    position: Array,
    weights: Array,
    place: Array,
    c: Array,
    deviations: Array,
) -> None:
    """Write signals and deviations (T, d) of poses `q` (T, nq) that are solved already.

    In order of time, for markers (T, M, 3) that are `believed` (T,) or not; the rest
    are arguments of :func:`control_frame`, `dt` (T,).
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    constants = unpack_constants(whole_constants, real_constants)
    for i in range(len(q)):
        n_seen, _ = take_markers(problem.marker_weight, markers[i], s.weight, s.target)
        errors_at(problem, s, q[i])
        _read_pose(
            problem, s, constants, q[i], dt[i], believed[i], seen_before, n_seen > 0,
            cavity_work, rotation, position, weights, place, c[i], deviations[i],
        )  # fmt: skip


@compiled
def _read_pose(
    problem: MarkerProblem,
    s: Scratch,
    constants: FrameConstants,
    q: Array,
    dt: float,
    believed: bool,
    seen_before: Array,
    posed: bool,
    cavity_work: Array,
    rotation: Array,
    position: Array,
    weights: Array,
    place: Array,
    c: Array,
    deviations: Array,
) -> int:
    """Read the signals off a pose whose errors are in `s`, if markers `posed` it.

    Of intent what hidden markers shift is taken off; the paper's is as the pose says.
    """
    paths, _, control_map, intent, segments = constants
    n_markers = len(segments.of_marker)
    memory, hand = seen_before[:n_markers], seen_before[n_markers:]
    place_frames(paths, q[7:].reshape(1, len(q) - 7), rotation, position)
    ends = control_map.ends
    for k in range(3):
        place[k] = 0.0
        for h in range(len(ends)):
            place[k] += position[0, ends[h], k]
        place[k] /= len(ends)
    for k in range(len(c)):
        c[k] = deviations[k] = np.nan
    hidden = note_markers(problem, s, dt, believed, segments, memory)
    if not posed:
        return NOT_FINITE
    solvable = factor_information(problem, s, q, segments, memory)
    status = _weights(control_map, place, cavity_work, weights)
    for k in range(len(c)):
        by_map = k > 0 or len(intent.numbers) == 0
        shifted = not by_map and intent.numbers[LEASH] > 0
        if not by_map:
            known = believed and _shows_hand(s.weight, control_map)
            c[k], taught = _intent(
                intent, q[7:], rotation, position, hand, known, s.gradient[6:]
            )
            status = INSIDE_HULL if taught else OUTSIDE_HULL
            for a in range(6):
                s.gradient[a] = 0.0
        else:
            c[k] = _signal(weights, control_map, k, q[7:], s.gradient)
        if not (solvable and np.isfinite(c[k])):
            continue
        deviations[k], shift = deviation(
            problem, s, s.gradient, segments, memory, hidden, shifted
        )
        if shifted:
            c[k] -= shift
        if hidden and by_map and deviations[k] > DOUBTFUL:
            _add_slopes(
                paths, control_map, k, q[7:], place, cavity_work, c[k], s.gradient
            )
            deviations[k], _ = deviation(
                problem, s, s.gradient, segments, memory, hidden, False
            )
    return status


@compiled
def _intent(
    intent: IntentNumbers,
    angles: Array,
    rotation: Array,
    position: Array,
    hand: Array,
    known: bool,
    gradient: Array,
) -> tuple[float, bool]:
    """Return the signal of intent, and whether taught; write its gradient (J,)."""
    c, taught, share = intent_signal(
        intent.paths,
        intent.numbers,
        intent.leverage,
        angles.reshape(1, len(angles)),
        rotation,
        position,
        np.empty(10),
        hand,
        known,
    )
    intent_gradient(
        intent.paths, intent.numbers, intent.leverage, angles, share, gradient
    )
    return c, taught


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
def _shows_hand(weight: Array, control_map: ControlMap) -> bool:
    """Whether enough markers of the hand, the last of the links, have a weight (M,)."""
    link, last, seen = control_map.link, len(control_map.need) - 1, 0
    for m in range(len(link)):
        if link[m] == last and weight[m] > 0:
            seen += 1
    return seen >= control_map.need[last]


@compiled
def _weights(
    control_map: ControlMap, place: Array, cavity_work: Array, weights: Array
) -> int:
    """Write the weights (P,) of the points at a place, (3,) m; return its status."""
    if len(control_map.indices):
        return natural_weights(
            control_map.numbers, control_map.indices, place, cavity_work, weights
        )
    return _nearest_weights(control_map.points, place, weights)


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
def _signal(
    weights: Array, control_map: ControlMap, k: int, angles: Array, gradient: Array
) -> float:
    """Return signal k, and write its gradient (n,) for the weights of this place."""
    directions, columns = control_map.directions, control_map.columns
    above = width = 0.0
    for d in range(len(gradient)):
        gradient[d] = 0.0
    for i in range(len(weights)):
        local = -control_map.lower[i, k]
        for j in range(len(columns)):
            local += directions[i, k, j] * angles[columns[j]]
            gradient[6 + columns[j]] += weights[i] * directions[i, k, j]
        above += weights[i] * local
        width += weights[i] * (control_map.upper[i, k] - control_map.lower[i, k])
    if not width > 0:
        return np.nan
    for d in range(len(gradient)):
        gradient[d] /= width
    return above / width


@compiled
def _add_slopes(
    paths: Paths,
    control_map: ControlMap,
    k: int,
    angles: Array,
    place: Array,
    cavity_work: Array,
    c: float,
    gradient: Array,
) -> None:
    """Add to a gradient (n,) what the place's weights change, as the hand moves.

    Secants over REACH either way, the steeper one: what lies beyond the hull counts.
    """
    slope, beside = np.empty(3), np.empty(3)
    unused, weights = np.empty(len(gradient)), np.empty(len(control_map.points))
    for a in range(3):
        slope[a] = 0.0
        for way in (-1.0, 1.0):
            for b in range(3):
                beside[b] = place[b]
            beside[a] += way * REACH
            _weights(control_map, beside, cavity_work, weights)
            change = _signal(weights, control_map, k, angles, unused) - c
            if abs(change) > abs(slope[a]):
                slope[a] = change * way
    axes, R, p = np.empty((len(paths.joint), 6)), np.empty((3, 3)), np.empty(3)
    for a in range(3):
        slope[a] /= REACH * len(control_map.ends)
    for e in control_map.ends:
        follow_path(paths, e, angles, R, p, axes)
        for i in range(paths.ends[e - 1] if e > 0 else 0, paths.ends[e]):
            x, y, z = axes[i, 0], axes[i, 1], axes[i, 2]
            dx, dy, dz = p[0] - axes[i, 3], p[1] - axes[i, 4], p[2] - axes[i, 5]
            gradient[6 + paths.joint[i, 1]] += (
                slope[0] * (y * dz - z * dy)
                + slope[1] * (z * dx - x * dz)
                + slope[2] * (x * dy - y * dx)
            )
