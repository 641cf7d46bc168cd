"""Labels that change places from one frame to the next.

Where two labels are exchanged, each marker jumps to where the other was. Bodies do not:
markers that move together by a vector v cannot each come to lie nearer than |v| / 2 to
where another of them was and still fill all their old places, as the jumps along such a
cycle sum to those of the motion itself. It takes a turn of more than a quarter within a
frame.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices

#: Shorter jumps are noise, m.
_JUMP = 0.01
#: A label that changed places lands nearer to the other's last place than this share of
#: its jump.
_SHARE = 0.5


@compiled
def follow_labels(
    markers: Array, dt: float, longest: float, last: Array, age: Array, owner: Indices
) -> bool:
    """Update whose marker each label carries by one frame of markers (M, 3), m.

    `last` (M, 3) are the last places and `age` (M,) how long before the frame before
    this one, `dt` ago, that was, s; after more than `longest` a place says nothing.
    `owner` (M,) are the labels that carried these markers in the beginning. Returns
    whether labels changed places.
    """
    n = len(markers)
    came = np.arange(n)
    changed = False
    if not dt >= 0:
        dt = np.inf  # also the first frame
    for m in range(n):
        age[m] += dt
    for m in range(n):
        jump = _square(markers[m], last[m])
        if not jump > _JUMP**2 or age[m] > longest:
            continue  # NaN too
        least = _SHARE**2 * jump
        for other in range(n):
            if other != m and age[other] <= longest:
                square = _square(markers[m], last[other])
                if square < least:
                    least, came[m], changed = square, other, True
    waiting = np.zeros(n, dtype=np.bool_)
    if changed:
        # Where the other one is out of sight, it may yet come back in this one's place.
        for m in range(n):
            waiting[m] = came[m] != m and np.isnan(markers[came[m], 0])
        changed = _keep_cycles(came)
    if changed:
        before = owner.copy()
        for m in range(n):
            owner[m] = before[came[m]]
    for m in range(n):
        if waiting[m] and came[m] == m:
            continue
        if np.isfinite(markers[m, 0] + markers[m, 1] + markers[m, 2]):
            age[m] = 0.0
            for k in range(3):
                last[m, k] = markers[m, k]
    return changed


@compiled
def _square(a: Array, b: Array) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@compiled
def _keep_cycles(came: Indices) -> bool:
    """Keep only labels that fill each other's places; return whether there are any."""
    n = len(came)
    again = True
    while again:
        again = False
        taken = np.zeros(n, dtype=np.int64)
        for m in range(n):
            if came[m] != m:
                taken[came[m]] += 1
        for m in range(n):
            # Whose place nobody took, or whose new place others took too, or had kept.
            alone = taken[m] != 1 or taken[came[m]] != 1 or came[came[m]] == came[m]
            if came[m] != m and alone:
                came[m], again = m, True
    for m in range(n):
        if came[m] != m:
            return True
    return False


@compiled
def labels_change(markers: Array, dt: float, longest: float) -> bool:
    """Whether any labels change places in frames (T, M, 3) m, every `dt` s.

    NaN where not seen.
    """
    n = markers.shape[1]
    last, age = np.full((n, 3), np.nan), np.full(n, np.inf)
    owner = np.arange(n)
    changed = False
    for i in range(len(markers)):
        changed = follow_labels(markers[i], dt, longest, last, age, owner) or changed
    return changed
