"""Follow a self-motion step by step: along the null direction, then back to the hand.

A walk gives the optimizer its first guess, and finds where a limit or a volume ends the
curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ikns.arrays import Array

Function = Callable[[Array], Array]

#: Step along the curve, rad of joint-space length.
STRIDE = 0.05
#: No self-motion of an arm is longer than this, rad; a continuous joint's may be.
_LONGEST = 30.0
#: Tolerance of the hands' pose, m and rad.
_TOLERANCE = 1e-10
#: Where the smallest relevant singular value of the Jacobian is below this share of the
#: largest, the null space has another dimension and the curve branches.
_SINGULAR = 1e-4
_MAX_STEPS = 20


@dataclass(frozen=True)
class Walk:
    """Postures (K, n) one after another along a self-motion, and what ended it.

    `why` is "blocked" by a limit or volume, which forbids the posture `beyond`,
    "closed" as the curve is, "singular" in the last posture, or "long".
    """

    postures: Array
    why: str
    beyond: Array | None = None


def come_back(off: Function, jacobian: Function, x: Array) -> Array | None:
    """Return the nearest joints whose hands are where they were; None if not found."""
    for _ in range(_MAX_STEPS):
        error = off(x)
        if np.abs(error).max() < _TOLERANCE:
            return x
        step = np.linalg.lstsq(jacobian(x), -error, rcond=1e-8)[0]
        x = x + step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-12))
    return None


def walk(
    off: Function,
    jacobian: Function,
    free: Callable[[Array], bool],
    start: Array,
    ahead: Array,
) -> Walk:
    """Walk from a posture until something stops it.

    `off` and `jacobian` are how far the hands are off and its derivative, `free` says
    whether a posture keeps all limits and volumes apart, `ahead` which of two ways to
    go.
    """
    postures, x, length = [start], start, 0.0
    while length < _LONGEST:
        _, values, rows = np.linalg.svd(jacobian(x))
        # A curve: of n joints n - 1 move the hand.
        if values[len(x) - 2] < _SINGULAR * values[0]:
            return Walk(np.array(postures), "singular")
        null = rows[-1]
        ahead = null if null @ ahead > 0 else -null
        stride = STRIDE
        # Where the curve bends sharply a shorter step converges.
        while (after := come_back(off, jacobian, x + stride * ahead)) is None or (
            np.linalg.norm(after - x) > 1.5 * stride
        ):
            stride /= 2
            if stride < 1e-4:
                return Walk(np.array(postures), "singular")
        if not free(after):
            return Walk(np.array(postures), "blocked", after)
        length += float(np.linalg.norm(after - x))
        apart = np.abs(np.angle(np.exp(1j * (after - start)))).max()
        if length > 4 * STRIDE and apart < STRIDE / 2 + 1e-3:
            return Walk(np.array([*postures, after]), "closed")
        postures.append(after)
        x = after
    return Walk(np.array(postures), "long")
