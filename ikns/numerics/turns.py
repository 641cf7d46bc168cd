"""Angles that are defined up to full turns, made comparable.

A controller reports a joint that can turn for ever within -pi to pi, or 0 to 2 pi; the
jump of a full turn is no movement, but the largest of all principal components.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask

_TURN = 2 * np.pi


def nearest_turn(angles: ArrayLike, center: ArrayLike) -> Array:
    """Return the same angles, each at most half a turn from a center, rad.

    Both arrays broadcast; an angle halfway stays within rounding of half a turn.

    >>> nearest_turn([3.0, -3.0], 3.1).round(3).tolist()
    [3.0, 3.283]
    """
    q = np.asarray(angles, dtype=np.float64)
    return np.asarray(q + _TURN * np.round((np.asarray(center) - q) / _TURN))


def without_turns(angles: ArrayLike, held: Mask) -> Array:
    """Angles of one joint over time without jumps of a full turn, (T,) rad.

    Each angle is at most half a turn from the one before. After that, the visits (rows
    in a row that are `held`, (T,)) are shifted by full turns so that their means lie
    on one side of the widest gap between them on the circle: however often the joint
    turned between two visits, the same posture has the same angle. A held row is a
    number; others may be NaN, and stay so.

    >>> wrapped = [3.0, -3.1, -3.1, 0.0, 0.0]
    >>> without_turns(wrapped, np.array([1, 1, 1, 0, 0], bool)).round(2).tolist()
    [3.0, 3.18, 3.18, 6.28, 6.28]
    """
    smooth = np.array(angles, dtype=np.float64)
    known = np.isfinite(smooth)
    smooth[known] = np.unwrap(smooth[known])
    ends = np.flatnonzero(np.diff(np.r_[False, np.asarray(held), False]))
    visits = [slice(first, after) for first, after in ends.reshape(-1, 2)]
    if not visits:
        return smooth
    means = np.array([smooth[visit].mean() for visit in visits])
    on_circle = np.sort(means % _TURN)
    gaps = np.diff(np.r_[on_circle, on_circle[0] + _TURN])
    # The middle of what the gap leaves: half a turn from the middle of the gap.
    widest = int(gaps.argmax())
    center = on_circle[widest] + gaps[widest] / 2 + np.pi
    # Of all full turns, that of the first visit.
    center = float(nearest_turn(center, means[0]))
    for visit, shift in zip(visits, nearest_turn(means, center) - means, strict=True):
        smooth[visit] += shift
    return smooth
