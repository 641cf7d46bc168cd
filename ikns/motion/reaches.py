"""Reaches: movements of the hand from one rest to the next."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Indices
from ikns.errors import InvalidInput


def find_reaches(
    speed: ArrayLike,
    position: ArrayLike,
    *,
    max_hand_speed: float = 0.05,
    min_distance: float = 0.05,
) -> Indices:
    """Reaches: the hand above the gate between two rests.

    Parameters
    ----------
    speed : (T,) array
        Of the hand, m/s; NaN where it is not known.
    position : (T, 3) array
        Of the hand, m.
    max_hand_speed : float
        Slower is a rest, m/s.
    min_distance : float
        Rests closer than this have no reach between them, m.

    Returns
    -------
    (R, 2) integer array
        Last sample of the rest before, first sample of the rest after. A stretch with
        an unknown speed or position is no reach.

    Examples
    --------
    >>> x = np.array([0, 0, 0.1, 0.3, 0.4, 0.4])
    >>> speed = [0, 0.01, 1, 2, 0.01, 0]
    >>> find_reaches(speed, np.stack([x, x, x], axis=1)).tolist()
    [[1, 4]]
    """
    v, x = np.asarray(speed, dtype=np.float64), np.asarray(position, dtype=np.float64)
    if x.shape != (len(v), 3) or not max_hand_speed > 0:
        raise InvalidInput(
            f"expected speeds (T,), positions (T, 3) and a gate above 0, found "
            f"{v.shape}, {x.shape} and {max_hand_speed:g} m/s."
        )
    known = np.isfinite(v) & np.isfinite(x).all(axis=1)
    rest = known & (v < max_hand_speed)
    ends = np.flatnonzero(np.diff(rest.astype(int)) == -1)  # last of each rest
    found = []
    for first in ends.tolist():
        after = np.flatnonzero(rest[first + 1 :])
        if not after.size:
            break
        last = first + 1 + int(after[0])
        far = float(np.linalg.norm(x[last] - x[first]))
        if known[first : last + 1].all() and far >= min_distance:
            found.append((first, last))
    return np.array(found, dtype=np.int64).reshape(-1, 2)
