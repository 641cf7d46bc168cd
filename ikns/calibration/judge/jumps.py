"""Markers that jump from one frame to the next: to another's place, or anywhere.

That labels change places is seen as in the live loop and in tracking, see
:mod:`ikns.motion.marker_ik.label_changes`; here without a body, so that the frames with
fewer changes count as right. For the rest each position is compared with where the
marker was, and with where its speed would have carried it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.motion.marker_ik.label_changes import label_changes

#: A marker that jumps alone leaves its path by more than this, m, and faster than a
#: hand that hits something, m/s^2 (60 g).
_ASTRAY, _HARDEST = 0.06, 600.0
#: Longest gap over which a position is compared, s; a hand turns over in 0.3 s.
_GAP = 0.1
#: Where so many of the markers jump at once, and at least so many, it is none of them.
_TOGETHER, _FEWEST = 0.8, 4


class Jumps(NamedTuple):
    """Jumps of M markers over T frames."""

    exchanged: dict[tuple[int, ...], Mask]  # frames in which these carry wrong names
    astray: dict[int, Mask]  # frames in which one is somewhere else
    together: list[int]  # frames to which all markers jump


def find_jumps(time: Array, markers: Array) -> Jumps:
    """Find labels that change places, and markers that leave their path.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    markers : (T, M, 3) array
        m; NaN where not seen.
    """
    n, m = markers.shape[:2]
    if n < 2 or not m:
        return Jumps({}, {}, [])
    changed, owners = label_changes(time, markers)
    hard, known = _hard_jumps(time, markers)
    hard[1:] &= owners[1:] == owners[:-1]
    count = known.sum(axis=1)
    together = (hard.sum(axis=1) > _TOGETHER * count) & (count >= _FEWEST)
    hard[together] = False
    return Jumps(
        _wrong_names(owners) if changed else {},
        {
            marker: _between(np.flatnonzero(hard[:, marker]), n)
            for marker in np.flatnonzero(hard.any(axis=0)).tolist()
        },
        np.flatnonzero(together).tolist(),
    )


def _hard_jumps(time: Array, markers: Array) -> tuple[Mask, Mask]:
    """Where markers leave their paths, and where that can be told, (T, M) each."""
    n, m = markers.shape[:2]
    step = float(np.median(np.diff(time)))
    rows = np.arange(n)[:, None]
    seen = np.isfinite(markers).all(axis=2)
    last = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    before = np.vstack([np.full((1, m), -1), last[:-1]])
    gap = time[:, None] - time[before]
    known = seen & (before >= 0) & (gap <= max(_GAP, 1.5 * step))
    columns = np.arange(m)[None]
    limit = np.maximum(_ASTRAY, _HARDEST * gap**2)
    with np.errstate(invalid="ignore"):
        hard = (_norm(markers - markers[before, columns]) > limit) & known
    # Speed tells of those alone that are far from where they were.
    at, column = np.nonzero(hard)
    last = before[at, column]
    here = markers[last, column]
    speed = (here - markers[last - 1, column]) / step
    speed[(last < 1) | ~np.isfinite(speed).all(axis=1)] = 0.0
    ahead = here + gap[at, column, None] * speed
    hard[at, column] = _norm(markers[at, column] - ahead) > limit[at, column]
    return np.asarray(hard), np.asarray(known)


def _wrong_names(owners: Indices) -> dict[tuple[int, ...], Mask]:
    """Find the frames in which labels carry others' markers, by these labels.

    Of `owners` (T, M), those that last longest count as right.
    """
    n, m = owners.shape
    group = np.arange(m)
    for a, b in np.unique(
        np.stack([np.broadcast_to(np.arange(m), (n, m)), owners], axis=2).reshape(
            -1, 2
        ),
        axis=0,
    ):
        group[group == group[b]] = group[a]
    found: dict[tuple[int, ...], Mask] = {}
    for number in np.unique(group).tolist():
        own = np.flatnonzero(group == number)
        ways, way, counts = np.unique(
            owners[:, own], axis=0, return_inverse=True, return_counts=True
        )
        way, right = way.reshape(-1), int(counts.argmax())
        for k, carried in enumerate(ways):
            if k != right:
                labels = tuple(own[carried != ways[right]].tolist())
                frames = found.setdefault(labels, np.zeros(n, dtype=bool))
                frames |= way == k
    return found


def _between(events: Indices, n: int) -> Mask:
    """Frames between the first and the second event, the third and the fourth, ...

    Of the two ways to count, the one with fewer frames.
    """
    flips = np.zeros(n, dtype=np.int64)
    np.add.at(flips, events, 1)
    inside = np.cumsum(flips) % 2 == 1
    return ~inside if inside.mean() > 0.5 else inside


def _norm(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
