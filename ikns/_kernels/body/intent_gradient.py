"""Gradient over the joints of the control signal of the method intent.

The swivel s turns with the shoulder p, the wrist w and the hinge axis z; the natural
posture with the wrist and the hand's direction. With n = unit(w - p), e = -z x n, the
reference u carried to n, b = -n x u and k = f x n (see
:mod:`ikns.nullspace.hinge_swivel`),

    ds = (e . u d(e . b) - e . b d(e . u)) / |e|^2

and joints move the points and the axis as in :mod:`ikns._kernels.body.paths`.
"""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.body.intent_signal import (
    DIRECTION,
    DOWN,
    FORWARD,
    GUARD,
    HAND,
    LOWER,
    MIDDLE,
    MIRROR,
    OFFSET,
    OWN,
    PEOPLE,
    REACH,
    SIZE,
    TAUGHT,
    UNIT,
    UPPER,
)
from ikns._kernels.body.paths import Paths, follow_path
from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array


@compiled
def intent_gradient(
    paths: Paths,
    numbers: Array,
    leverage: Array,
    angles: Array,
    share: float,
    gradient: Array,
) -> None:
    """Write the gradient of c over all joint angles, (J,) per rad.

    Arguments are those of :func:`ikns._kernels.body.intent_signal.intent_signal`, with
    `angles` (J,), and `share`, how much of the hand's direction is in c. NaN where the
    swivel is undefined.
    """
    axes = np.empty((len(paths.joint), 6))
    upper_arm, turned = np.empty((3, 3)), np.empty((3, 3))
    p, w = np.empty(3), np.empty(3)
    follow_path(paths, 0, angles, upper_arm, p, axes)
    follow_path(paths, 1, angles, turned, w, axes)
    by_axis, by_wrist, natural = np.empty(3), np.empty(3), np.empty(3)
    swivel_gradient(numbers, upper_arm, p, w, by_axis, by_wrist)
    natural_gradient(numbers, leverage, w, natural)
    direction, by_turn = np.empty(3), np.empty(3)
    for i in range(3):
        direction[i] = 0.0
        for j in range(3):
            direction[i] += share * turned[i, j] * numbers[HAND + j]
    _cross(direction, numbers[DIRECTION : DIRECTION + 3], by_turn)
    width = numbers[UPPER] - numbers[LOWER]
    for i in range(len(gradient)):
        gradient[i] = 0.0
    for k in range(paths.ends[1]):
        x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
        first = k < paths.ends[0]
        end = p if first else w
        dx, dy, dz = end[0] - axes[k, 3], end[1] - axes[k, 4], end[2] - axes[k, 5]
        vx, vy, vz = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx
        if first:
            a0, a1, a2 = upper_arm[0, 2], upper_arm[1, 2], upper_arm[2, 2]
            total = by_axis[0] * (y * a2 - z * a1) + by_axis[1] * (z * a0 - x * a2)
            total += by_axis[2] * (x * a1 - y * a0)
            total -= by_wrist[0] * vx + by_wrist[1] * vy + by_wrist[2] * vz
        else:
            total = (by_wrist[0] - natural[0]) * vx + (by_wrist[1] - natural[1]) * vy
            total += (by_wrist[2] - natural[2]) * vz
            total -= x * by_turn[0] + y * by_turn[1] + z * by_turn[2]
        gradient[paths.joint[k, 1]] += total / width


@inner
def swivel_gradient(
    numbers: Array,
    upper_arm: Array,
    shoulder: Array,
    wrist: Array,
    by_axis: Array,
    by_wrist: Array,
) -> None:
    """Write the swivel's gradient over the hinge axis and the wrist, (3,) each.

    Of the shoulder it is that of the wrist with the other sign.
    """
    m, f, d = numbers[MIRROR], numbers[FORWARD : FORWARD + 3], numbers[DOWN : DOWN + 3]
    n, z, k, kd = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    e, u, b, t, h = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    one, two, three = np.empty(3), np.empty(3), np.empty(3)
    length = 0.0
    for a in range(3):
        n[a] = (wrist[a] - shoulder[a]) * (m if a == 2 else 1.0)
        # An axis of rotation is mirrored the other way.
        z[a] = upper_arm[a, 2] * (1.0 if a == 2 else m)
        length += n[a] ** 2
    length = math.sqrt(length)
    for a in range(3):
        n[a] /= length
    _cross(n, z, e)
    behind = 1.0 + _dot(f, n)
    _cross(f, n, k)
    _cross(k, d, kd)
    _cross(k, kd, one)
    for a in range(3):
        u[a] = d[a] + kd[a] + one[a] / behind
    back = one.copy()
    _cross(u, n, b)
    across, along = _dot(e, b), _dot(e, u)
    square = across**2 + along**2
    across, along = across / square, along / square
    _cross(e, n, one)
    for a in range(3):
        t[a] = along * b[a] - across * u[a]
        h[a] = -along * one[a] - across * e[a]
    # dk x d, dk x (k x d) and k x (dk x d), each against h, by dk.
    _cross(d, h, one)
    _cross(kd, h, two)
    _cross(h, k, k)
    _cross(d, k, three)
    for a in range(3):
        one[a] += (two[a] + three[a]) / behind
    _cross(one, f, two)
    _cross(t, z, one)
    _cross(u, e, three)
    bend = _dot(back, h) / behind**2
    for a in range(3):
        two[a] -= one[a] + along * three[a] + bend * f[a]
    straight = _dot(two, n)
    _cross(n, t, one)
    for a in range(3):
        by_wrist[a] = (two[a] - straight * n[a]) / length * (m if a == 2 else 1.0)
        by_axis[a] = -one[a] * (1.0 if a == 2 else m)


@inner
def natural_gradient(
    numbers: Array, leverage: Array, wrist: Array, gradient: Array
) -> None:
    """Write the gradient of the natural swivel over the wrist, (3,) rad/m."""
    m, unit = numbers[MIRROR], numbers[UNIT]
    x1 = (wrist[0] - numbers[MIDDLE]) / unit
    x2 = (wrist[1] - numbers[MIDDLE + 1]) / unit
    x3 = (wrist[2] * m - numbers[MIDDLE + 2]) / unit
    terms = (1.0, x1, x2, x3, x1 * x1, x2 * x2, x3 * x3, x1 * x2, x1 * x3, x2 * x3)
    slope, own, h = np.empty(10), 0.0, 0.0
    for i in range(10):
        own += terms[i] * numbers[OWN + i]
        slope[i] = 0.0
        for j in range(10):
            slope[i] += leverage[i, j] * terms[j]
        h += terms[i] * slope[i]
    beyond = h / numbers[TAUGHT]
    guarded = numbers[GUARD] > 0 and beyond > 1.0
    for i in range(10):
        if guarded:
            # By the leverage too, whose gradient is twice this of its matrix.
            bend = (own - numbers[OFFSET]) / (beyond * beyond * numbers[TAUGHT])
            slope[i] = numbers[OWN + i] / beyond - 2 * bend * slope[i]
        else:
            slope[i] = numbers[OWN + i]
        slope[i] += numbers[PEOPLE + i]
    gradient[0] = slope[1] + 2 * slope[4] * x1 + slope[7] * x2 + slope[8] * x3
    gradient[1] = slope[2] + 2 * slope[5] * x2 + slope[7] * x1 + slope[9] * x3
    gradient[2] = slope[3] + 2 * slope[6] * x3 + slope[8] * x1 + slope[9] * x2
    for a in range(3):
        gradient[a] /= unit
    square = numbers[REACH] ** 2
    for k in range(SIZE, len(numbers), 4):
        dx, dy = wrist[0] - numbers[k], wrist[1] - numbers[k + 1]
        dz = wrist[2] * m - numbers[k + 2]
        far = (dx * dx + dy * dy + dz * dz) / square
        if far < 1.0:
            # k'(r) / r = -20 (1 - r)^3 has no singularity at the place itself.
            steep = -20 * (1 - math.sqrt(far)) ** 3 * numbers[k + 3] / square
            gradient[0] += steep * dx
            gradient[1] += steep * dy
            gradient[2] += steep * dz
    gradient[2] *= m


@compiled
def _cross(a: Array, b: Array, into: Array) -> None:
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    into[2] = a[0] * b[1] - a[1] * b[0]
    into[0], into[1] = x, y


@compiled
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
