"""The control signal of the method proximal for one posture, and its gradient.

    c = sum_i w_i (Z_i . y - m_i) / sum_i w_i (M_i - m_i)

with the smooth weights w of the hand position x (:mod:`ikns.nullspace.map.smooth`) and,
for each arm, y = (r, elbow flexion): the rotation vector r of the upper arm about its
reference, R = reference exp(r). A joint that turns the upper arm about the axis z of
the thorax frame moves it by

    dr = v - r x v / 2 + k r x (r x v),  v = reference' z,
    k = 1 / t^2 - (1 + cos t) / (2 t sin t),  t = |r|

(Chirikjian 2011, Stochastic Models, Information Theory, and Lie Groups 2, 10.86).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.paths import Paths, follow_path
from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices


class ProximalNumbers(NamedTuple):
    """Constants of :func:`proximal_signal` for S arms and P points."""

    arms: Paths  # from the thorax to each upper arm
    hands: Paths  # from the thorax to each hand, whose mean is the place
    flexion: Indices  # (S,) elbow flexion among the angles
    reference: Array  # (S, 3, 3)
    points: Array  # (P, 3) m
    smoother: Array  # (P + 4, P), or (0, 0) where every point weighs the same
    metric: Array  # (3, 3) of the leverage, 1/m^2
    field: Array  # (5,) the points' middle, scale of lengths, largest leverage
    directions: Array  # (P, 4 S)
    ends: Array  # (2, P) m and M, rad


@compiled
def proximal_signal(
    numbers: ProximalNumbers, angles: Array, place: Array, gradient: Array
) -> tuple[float, bool]:
    """Return c, not clipped, and whether the place is among the points.

    Parameters
    ----------
    numbers : ProximalNumbers
    angles : (J,) array
        rad.
    place : (3,) array
        Of the hand, or the middle of both, m in the thorax frame.
    gradient : (J,) array
        Written, per rad.
    """
    P, n = numbers.directions.shape
    y, by_y, by_x = np.empty(n), np.zeros(n), np.zeros(3)
    R, p = np.empty((3, 3)), np.empty(3)
    turns = np.empty((len(numbers.arms.joint), 6))
    for e in range(len(numbers.flexion)):
        follow_path(numbers.arms, e, angles, R, p, turns)
        _rotation_vector(numbers.reference[e], R, y[4 * e : 4 * e + 3])
        y[4 * e + 3] = angles[numbers.flexion[e]]
    weights, slopes = np.empty(P), np.empty((P, 3))
    inside = _smooth_weights(numbers, place, weights, slopes)
    above = width = 0.0
    for i in range(P):
        local = -numbers.ends[0, i]
        for a in range(n):
            local += numbers.directions[i, a] * y[a]
        above += weights[i] * local
        width += weights[i] * (numbers.ends[1, i] - numbers.ends[0, i])
    for j in range(len(gradient)):
        gradient[j] = 0.0
    if not width > 0:
        return np.nan, inside
    c = above / width
    for i in range(P):
        local = -numbers.ends[0, i] - c * (numbers.ends[1, i] - numbers.ends[0, i])
        for a in range(n):
            local += numbers.directions[i, a] * y[a]
            by_y[a] += weights[i] * numbers.directions[i, a] / width
        for a in range(3):
            by_x[a] += slopes[i, a] * local / width
    for e in range(len(numbers.flexion)):
        gradient[numbers.flexion[e]] += by_y[4 * e + 3]
        _add_turns(numbers, e, turns, y[4 * e : 4 * e + 3], by_y[4 * e :], gradient)
    paths = numbers.hands
    axes = np.empty((len(paths.joint), 6))
    for e in range(len(paths.ends)):
        follow_path(paths, e, angles, R, p, axes)
        for k in range(paths.ends[e - 1] if e > 0 else 0, paths.ends[e]):
            x, z, w = axes[k, 0], axes[k, 1], axes[k, 2]
            dx, dy, dz = p[0] - axes[k, 3], p[1] - axes[k, 4], p[2] - axes[k, 5]
            moved = by_x[0] * (z * dz - w * dy) + by_x[1] * (w * dx - x * dz)
            moved += by_x[2] * (x * dy - z * dx)
            gradient[paths.joint[k, 1]] += moved / len(paths.ends)
    return c, inside


@compiled
def _rotation_vector(reference: Array, R: Array, into: Array) -> None:
    """Write r of R = reference exp(r), (3,), by the larger half of a quaternion."""
    Q = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            for d in range(3):
                Q[a, b] += reference[d, a] * R[d, b]
    trace = Q[0, 0] + Q[1, 1] + Q[2, 2]
    k = 3
    largest = trace
    for a in range(3):
        if Q[a, a] > largest:
            k, largest = a, Q[a, a]
    q = np.empty(4)
    if k == 3:
        q[0], q[1] = Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0]
        q[2], q[3] = Q[1, 0] - Q[0, 1], 1.0 + trace
    else:
        a, b = (k + 1) % 3, (k + 2) % 3
        q[k], q[3] = 1.0 + 2.0 * Q[k, k] - trace, Q[b, a] - Q[a, b]
        q[a], q[b] = Q[a, k] + Q[k, a], Q[b, k] + Q[k, b]
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    length = math.sqrt(sine * sine + q[3] * q[3])
    sign = -1.0 if q[3] < 0 else 1.0
    factor = 2.0 / length  # of a small turn
    if sine > 1e-9 * length:
        factor = 2.0 * math.atan2(sine, sign * q[3]) / sine
    for a in range(3):
        into[a] = sign * factor * q[a]


@compiled
def _smooth_weights(
    numbers: ProximalNumbers, place: Array, weights: Array, slopes: Array
) -> bool:
    """Write the weights (P,) at a place and their slopes (P, 3), 1/m."""
    P, scale, most = len(weights), numbers.field[3], numbers.field[4]
    if not len(numbers.smoother):
        for i in range(P):
            weights[i] = 1.0 / P
            for a in range(3):
                slopes[i, a] = 0.0
        return False
    terms, away, bend = np.empty(P + 4), np.zeros((P + 4, 3)), np.empty(3)
    terms[P] = 1.0
    leverage = 1.0 / P
    for a in range(3):
        spread = place[a] - numbers.field[a]
        terms[P + 1 + a] = spread / scale
        away[P + 1 + a, a] = 1.0 / scale
        bend[a] = 0.0
        for b in range(3):
            bend[a] += numbers.metric[a, b] * (place[b] - numbers.field[b])
        leverage += spread * bend[a]
    for i in range(P):
        apart = 0.0
        for a in range(3):
            apart += (place[a] - numbers.points[i, a]) ** 2
        apart = math.sqrt(apart)
        terms[i] = -apart / scale
        for a in range(3):
            step = place[a] - numbers.points[i, a]
            # At a point itself the distance has no slope; its mean is zero.
            away[i, a] = -step / (apart * scale) if apart > 0 else 0.0
    beyond = max(leverage / most - 1.0, 0.0)
    fade = 1.0 / (1.0 + beyond)
    for i in range(P):
        own = -1.0 / P
        for a in range(3):
            slopes[i, a] = 0.0
        for t in range(P + 4):
            own += terms[t] * numbers.smoother[t, i]
            for a in range(3):
                slopes[i, a] += fade * away[t, a] * numbers.smoother[t, i]
        weights[i] = 1.0 / P + fade * own
        if beyond > 0:
            for a in range(3):
                slopes[i, a] -= fade * fade * own * 2.0 * bend[a] / most
    return leverage <= most * (1 + 1e-12)


@compiled
def _add_turns(
    numbers: ProximalNumbers,
    e: int,
    axes: Array,
    r: Array,
    by_r: Array,
    gradient: Array,
) -> None:
    """Add to the gradient what joints do to c by turning upper arm e."""
    arms, start = numbers.arms, numbers.reference[e]
    t = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    k = 1.0 / 12.0
    if t > 1e-4:
        k = 1.0 / (t * t) - (1.0 + math.cos(t)) / (2.0 * t * math.sin(t))
    v, once, twice = np.empty(3), np.empty(3), np.empty(3)
    for j in range(arms.ends[e - 1] if e > 0 else 0, arms.ends[e]):
        for a in range(3):
            v[a] = 0.0
            for b in range(3):
                v[a] += start[b, a] * axes[j, b]
        for a in range(3):
            b, d = (a + 1) % 3, (a + 2) % 3
            once[a] = r[b] * v[d] - r[d] * v[b]
        for a in range(3):
            b, d = (a + 1) % 3, (a + 2) % 3
            twice[a] = r[b] * once[d] - r[d] * once[b]
        for a in range(3):
            turned = v[a] - once[a] / 2 + k * twice[a]
            gradient[arms.joint[j, 1]] += by_r[a] * turned
