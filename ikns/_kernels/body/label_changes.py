"""Labels that change places from one frame to the next.

Where two labels are exchanged, each marker jumps to where the other was. Bodies do not:
markers that move together by a vector v cannot each come to lie nearer than |v| / 2 to
where another of them was and still fill all their old places, as the jumps along such a
cycle sum to those of the motion itself. It takes a turn of more than a quarter within a
frame. Nor does the line from one marker to another turn round within a frame, however
fast both move.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices, Mask

#: Shorter jumps are noise, m.
_JUMP = 0.01
#: A label that changed places lands nearer to the other's last place than this share of
#: its jump.
_SHARE = 0.5
#: How far the line between two exchanged markers may miss the opposite of what it was,
#: over its length; markers nearer to each other than this, m, are one place; and what
#: their middle may move besides, m.
_MISSES, _ONE_PLACE, _MIDDLE = 0.4, 0.012, 0.06


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
    jumps = np.zeros(n, dtype=np.bool_)
    for m in range(n):
        # NaN jumps nowhere.
        jumps[m] = _square(markers[m], last[m]) > _JUMP**2 and age[m] <= longest
    for m in range(n):
        if not jumps[m]:
            continue
        least = _SHARE**2 * _square(markers[m], last[m])
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
    changed = _turn_round(markers, last, jumps, came) or changed
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
def _turn_round(markers: Array, last: Array, jumps: Mask, came: Indices) -> bool:
    """Write pairs of labels whose line turned round; return whether there are any.

    Of several, each label's best, if it is the other's best too. Labels that fill each
    other's places already are left as they are.
    """
    n = len(markers)
    least, best = np.full(n, np.inf), np.arange(n)
    for a in range(n):
        for b in range(a + 1, n):
            if not (jumps[a] and jumps[b] and came[a] == a and came[b] == b):
                continue
            apart = _square(last[a], last[b])
            over = middle = 0.0
            for k in range(3):
                now, before = markers[a, k] - markers[b, k], last[a, k] - last[b, k]
                over += (now + before) ** 2
                middle += (markers[a, k] + markers[b, k] - last[a, k] - last[b, k]) ** 2
            limit = _MISSES**2 * apart
            near = middle / 4 < max(limit, _MIDDLE**2)
            if not (apart > _ONE_PLACE**2 and over < limit and near):
                continue
            for m, other in ((a, b), (b, a)):
                if over / apart < least[m]:
                    least[m], best[m] = over / apart, other
    found = False
    for m in range(n):
        if best[m] != m and best[best[m]] == m:
            came[m], found = best[m], True
    return found


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
            # Whose place no one took, or whose new place others took too, or had kept.
            alone = taken[m] != 1 or taken[came[m]] != 1 or came[came[m]] == came[m]
            if came[m] != m and alone:
                came[m], again = m, True
    for m in range(n):
        if came[m] != m:
            return True
    return False


@compiled
def label_owners(time: Array, markers: Array, longest: float, owners: Indices) -> bool:
    """Write whose marker each label carries in frames (T, M, 3) m, NaN where not seen.

    `time` (T,) s and `longest` as for :func:`follow_labels`; `owners` (T, M) are labels
    of the first frame. Returns whether labels ever change places.
    """
    n = markers.shape[1]
    last, age = np.full((n, 3), np.nan), np.full(n, np.inf)
    owner = np.arange(n)
    changed = False
    for i in range(len(markers)):
        dt = time[i] - time[i - 1] if i else np.nan
        changed = follow_labels(markers[i], dt, longest, last, age, owner) or changed
        owners[i] = owner
    return changed
