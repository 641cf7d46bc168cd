"""The hand's direction as the wrist has led it: what a hand that turns leaves alone.

A natural posture goes with the hand's direction, and yet a hand that turns where it is,
as to empty a glass, is no wish. So the direction that counts follows the hand only
along the path of the wrist. An anchor is dragged behind the wrist by a leash; where it
is dragged by d, the led direction goes a share 1 - exp(-d / leash) of the way to the
hand's. A held hand stays within the leash, and after a reach of five leashes 2 % of
what was before is left.

It depends on the path and on nothing else: not on speed, nor on how often cameras look.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.nullspace.map.checks import checked_rows
from ikns.nullspace.posture_terms import HAND, WRIST

#: Length of the leash, m. Held hands wander by 4 mm (standard deviation an axis, what
#: the simulation does too), so they are within it at three deviations; reaches, of 0.1
#: m or more, are five times as long.
LEASH = 0.02


def led_direction(X: ArrayLike, leash: float = LEASH) -> Array:
    """Replace the hand's direction in each row by the one that the wrist has led there.

    Parameters
    ----------
    X : (T, 6) array
        Wrist centers, m, and the hand's directions, in order of time. Rows that are not
        finite are passed over.
    leash : float
        m; 0 leaves all as it is.

    Returns
    -------
    (T, 6) array
        Directions are means of unit vectors, not longer than 1.

    Examples
    --------
    >>> turned = led_direction([[0, 0, 0, 1, 0, 0], [0.01, 0, 0, 0, 1, 0]])
    >>> carried = led_direction([[0, 0, 0, 1, 0, 0], [0.2, 0, 0, 0, 1, 0]])
    >>> turned[1, 3:].tolist(), carried[1, 3:].round(3).tolist()
    ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    """
    out = checked_rows(np.array(X, dtype=np.float64), HAND, "places")
    if not leash > 0:
        return out
    anchor: list[float] = []
    led: list[float] = []
    for t in np.flatnonzero(np.isfinite(out).all(axis=1)).tolist():
        row = out[t].tolist()
        wrist, way = row[:WRIST], row[WRIST:]
        far = math.dist(wrist, anchor) if anchor else 0.0
        if not anchor:
            anchor, led = wrist, way
        elif far > leash:
            share, drag = 1.0 - math.exp(1.0 - far / leash), 1.0 - leash / far
            led = [a + share * (b - a) for a, b in zip(led, way, strict=True)]
            anchor = [a + drag * (b - a) for a, b in zip(anchor, wrist, strict=True)]
        out[t, WRIST:] = led
    return out
