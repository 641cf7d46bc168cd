"""The control signal of the method intent for one posture.

    c = (s - s_nat(w) - a) / (b - a)

with the hinge swivel s (:mod:`ikns.nullspace.hinge_swivel`) and the natural posture
s_nat at the wrist center w (:mod:`ikns.nullspace.natural_posture`), whose constants are
handed in.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.paths import Paths, place_frames
from ikns._kernels.compiled import compiled
from ikns.arrays import Array


class IntentNumbers(NamedTuple):
    """Constants of one arm's map; the wrist of a left arm is mirrored to the right."""

    coefficients: Array  # (10,) rad
    people: Array  # (10,) rad
    leverage: Array  # (10, 10)
    offset: float  # rad
    taught_leverage: float
    guard: bool
    lower: float  # a, rad
    upper: float  # b, rad
    mirror: float  # -1 for a left arm, else 1
    middle: Array  # (3,) m, of the quadratic terms
    unit: float  # m
    forward: Array  # (3,) where the swivel's reference starts
    down: Array  # (3,) the reference there


@compiled
def intent_signal(
    paths: Paths,
    numbers: IntentNumbers,
    angles: Array,
    rotation: Array,
    position: Array,
    terms: Array,
) -> tuple[float, bool]:
    """Return c, not clipped, and whether natural movement was taught at the wrist.

    Parameters
    ----------
    paths : Paths
        From the thorax to the upper arm and to the hand's link.
    numbers : IntentNumbers
    angles : (1, J) array
        Joint angles, rad.
    rotation, position, terms : (1, 2, 3, 3), (1, 2, 3) and (10,) arrays
        Scratch.

    Returns
    -------
    c : float
        NaN where the swivel is undefined.
    taught : bool
    """
    place_frames(paths, angles, rotation, position)
    m = numbers.mirror
    s = _swivel(numbers, rotation[0, 0], position[0, 0], position[0, 1])
    x = (position[0, 1, 0] - numbers.middle[0]) / numbers.unit
    y = (position[0, 1, 1] - numbers.middle[1]) / numbers.unit
    z = (m * position[0, 1, 2] - numbers.middle[2]) / numbers.unit
    terms[0], terms[1], terms[2], terms[3] = 1.0, x, y, z
    terms[4], terms[5], terms[6] = x * x, y * y, z * z
    terms[7], terms[8], terms[9] = x * y, x * z, y * z
    people = own = h = 0.0
    for i in range(10):
        people += terms[i] * numbers.people[i]
        own += terms[i] * (numbers.coefficients[i] - numbers.people[i])
        for j in range(10):
            h += terms[i] * numbers.leverage[i, j] * terms[j]
    beyond = h / numbers.taught_leverage
    if numbers.guard and beyond > 1.0:
        own = numbers.offset + (own - numbers.offset) / beyond
    rest = s - people - own
    rest -= 2 * math.pi * math.floor((rest + math.pi) / (2 * math.pi))
    return (rest - numbers.lower) / (numbers.upper - numbers.lower), beyond <= 1.0


@compiled
def _swivel(
    numbers: IntentNumbers, upper_arm: Array, shoulder: Array, wrist: Array
) -> float:
    """Angle of the elbow by its hinge, the third axis of the upper arm, rad."""
    m, f, d = numbers.mirror, numbers.forward, numbers.down
    nx, ny = wrist[0] - shoulder[0], wrist[1] - shoulder[1]
    nz = m * (wrist[2] - shoulder[2])
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    # An axis of rotation is mirrored the other way.
    zx, zy, zz = m * upper_arm[0, 2], m * upper_arm[1, 2], upper_arm[2, 2]
    ex, ey, ez = -(zy * nz - zz * ny), -(zz * nx - zx * nz), -(zx * ny - zy * nx)
    behind = 1.0 + nx * f[0] + ny * f[1] + nz * f[2]
    if not (behind > 1e-9 and ex * ex + ey * ey + ez * ez > 1e-18):
        return np.nan
    kx, ky, kz = f[1] * nz - f[2] * ny, f[2] * nx - f[0] * nz, f[0] * ny - f[1] * nx
    ax, ay, az = ky * d[2] - kz * d[1], kz * d[0] - kx * d[2], kx * d[1] - ky * d[0]
    ux = d[0] + ax + (ky * az - kz * ay) / behind
    uy = d[1] + ay + (kz * ax - kx * az) / behind
    uz = d[2] + az + (kx * ay - ky * ax) / behind
    across = (
        ex * (nz * uy - ny * uz) + ey * (nx * uz - nz * ux) + ez * (ny * ux - nx * uy)
    )
    return math.atan2(across, ex * ux + ey * uy + ez * uz)
