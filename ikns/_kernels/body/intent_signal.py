"""The control signal of the method intent for one posture.

    c = (s - s_nat(w, l) - a) / (b - a)

with the hinge swivel s (:mod:`ikns.nullspace.hinge_swivel`) and the natural posture
s_nat for the wrist center w and the hand's direction l
(:mod:`ikns.nullspace.natural_posture`), whose constants are handed in. What is
remembered of particular places is added up one by one. l is the direction that the
wrist has led here (:mod:`ikns.nullspace.led_direction`): the memory of the hand has
where its anchor is, and the direction.
"""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.body.paths import Paths, place_frames
from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array

# One array of numbers takes less time to hand over than a dozen. Its layout; all of the
# right arm, to which a left one is mirrored:
OWN = 0  # 10 coefficients less those of other people, rad
PEOPLE = 10  # 10 of other people, rad
OFFSET = 20  # rad
TAUGHT = 21  # 99th percentile of the taught leverage
GUARD = 22  # 1 where the own part fades outside what was taught, else 0
LOWER, UPPER = 23, 24  # a and b, rad
MIRROR = 25  # -1 for a left arm, else 1
MIDDLE, UNIT = 26, 29  # of the quadratic terms, 3 and 1, m
FORWARD, DOWN = 30, 33  # where the swivel's reference starts, and it there, 3 each
REACH = 36  # of a bump around a place, m
HAND = 37  # direction from wrist to knuckle in the hand's frame, 3
DIRECTION = 40  # its 3 coefficients in the thorax frame of this arm, not mirrored, rad
LEASH = 43  # of the hand's direction, m; 0 in maps of before, which read as they did
SIZE = 44  # places and heights follow, m and rad, 4 for each

# Rows of the memory of the hand.
_ANCHOR, _LED = 0, 1


def new_hand_memory(width: int) -> Array:
    """Return the memory of a hand that was not seen yet, (2, width)."""
    return np.full((2, width), np.nan)


@compiled
def intent_signal(
    paths: Paths,
    numbers: Array,
    leverage: Array,
    angles: Array,
    rotation: Array,
    position: Array,
    terms: Array,
    hand: Array,
    known: bool,
) -> tuple[float, bool, float]:
    """Return c, not clipped, whether taught, and how much it takes of the hand.

    Parameters
    ----------
    paths : Paths
        From the thorax to the upper arm and to the hand's link.
    numbers : (SIZE + 4 M,) array
        See the layout above.
    leverage : (10, 10) array
    angles : (1, J) array
        Joint angles, rad.
    rotation, position, terms : (1, 2, 3, 3), (1, 2, 3) and (10,) arrays
        Scratch.
    hand : (2, 3 or more) array
        Memory of the hand, see :func:`new_hand_memory`.
    known : bool
        Whether the hand is seen and believed, so that the memory may be written.

    Returns
    -------
    c : float
        NaN where the swivel is undefined.
    taught : bool
        Whether natural movement was taught at the wrist.
    share : float
        How much of the hand's direction in this frame is in c; 1 where `known`, as
        then all that was led here was seen.
    """
    place_frames(paths, angles, rotation, position)
    s = _swivel(numbers, rotation[0, 0], position[0, 0], position[0, 1])
    terms[0] = 1.0
    for k in range(3):
        at = position[0, 1, k] * (numbers[MIRROR] if k == 2 else 1.0)
        terms[1 + k] = (at - numbers[MIDDLE + k]) / numbers[UNIT]
        terms[4 + k] = terms[1 + k] ** 2
    terms[7], terms[8] = terms[1] * terms[2], terms[1] * terms[3]
    terms[9] = terms[2] * terms[3]
    people = own = h = 0.0
    for i in range(10):
        people += terms[i] * numbers[PEOPLE + i]
        own += terms[i] * numbers[OWN + i]
        for j in range(10):
            h += terms[i] * leverage[i, j] * terms[j]
    beyond = h / numbers[TAUGHT]
    if numbers[GUARD] > 0 and beyond > 1.0:
        own = numbers[OFFSET] + (own - numbers[OFFSET]) / beyond
    z = numbers[MIRROR] * position[0, 1, 2]
    near = _near(numbers, position[0, 1, 0], position[0, 1, 1], z)
    pointing, share = _pointing(numbers, rotation[0, 1], position[0, 1], hand, known)
    rest = s - people - own - near - pointing
    rest -= 2 * math.pi * math.floor((rest + math.pi) / (2 * math.pi))
    width = numbers[UPPER] - numbers[LOWER]
    return (rest - numbers[LOWER]) / width, beyond <= 1.0, share


@inner
def _pointing(
    numbers: Array, turned: Array, wrist: Array, hand: Array, known: bool
) -> tuple[float, float]:
    """Return what the led direction adds to the natural swivel, rad, and its share."""
    total = far = 0.0
    if not numbers[LEASH] > 0:
        for i in range(3):
            for j in range(3):
                total += numbers[DIRECTION + i] * (turned[i, j] * numbers[HAND + j])
        return total, 1.0
    for i in range(3):
        far += (wrist[i] - hand[_ANCHOR, i]) ** 2
    far, share, leash = math.sqrt(far), 1.0, numbers[LEASH]
    # NaN before the hand was seen for the first time.
    led = far >= 0
    if led:
        share = 1.0 - math.exp(1.0 - far / leash) if far > leash else 0.0
    for i in range(3):
        way = 0.0
        for j in range(3):
            way += turned[i, j] * numbers[HAND + j]
        if led:
            way = hand[_LED, i] + share * (way - hand[_LED, i])
        total += numbers[DIRECTION + i] * way
        if known:
            hand[_LED, i] = way
            if not led:
                hand[_ANCHOR, i] = wrist[i]
            elif far > leash:
                hand[_ANCHOR, i] += (wrist[i] - hand[_ANCHOR, i]) * (1.0 - leash / far)
    return total, 1.0 if known else share


@compiled
def _near(numbers: Array, x: float, y: float, z: float) -> float:
    """Return the sum of the bumps of :mod:`ikns.nullspace.local_posture`, rad."""
    total, square = 0.0, numbers[REACH] ** 2
    for k in range(SIZE, len(numbers), 4):
        far = (x - numbers[k]) ** 2 + (y - numbers[k + 1]) ** 2
        far += (z - numbers[k + 2]) ** 2
        if far < square:
            r = math.sqrt(far / square)
            total += numbers[k + 3] * (1 - r) ** 4 * (1 + 4 * r)
    return total


@compiled
def _swivel(numbers: Array, upper_arm: Array, shoulder: Array, wrist: Array) -> float:
    """Angle of the elbow by its hinge, the third axis of the upper arm, rad."""
    m, f, d = numbers[MIRROR], numbers[FORWARD:], numbers[DOWN:]
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
