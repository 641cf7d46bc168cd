"""Markers that jump from one frame to the next: to another's place, or anywhere.

Each position is compared with where the marker was, and with where its speed would have
carried it. When two labels are exchanged, the line from one marker to the other turns
round within a frame: no body does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Mask

#: Smaller jumps are not looked at, m: markers closer than this are one place.
_SHORTEST = 0.012
#: How far the line between two exchanged markers may miss the opposite of what it was,
#: over its length.
_EXCHANGED = 0.4
#: A marker that jumps alone leaves its path by more than this, m, and faster than a
#: hand that hits something, m/s^2 (60 g).
_ASTRAY, _HARDEST = 0.06, 600.0
#: Longest gap over which a position is compared, s; a hand turns over in 0.3 s.
_GAP = 0.1


class Jumps(NamedTuple):
    """Jumps of M markers over T frames."""

    exchanged: dict[tuple[int, int], Mask]  # frames in which two carry wrong names
    astray: dict[int, Mask]  # frames in which one is somewhere else


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
    nothing = Jumps({}, {})
    if n < 2 or not m:
        return nothing
    step = float(np.median(np.diff(time)))
    rows = np.arange(n)[:, None]
    seen = np.isfinite(markers).all(axis=2)
    last = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    before = np.vstack([np.full((1, m), -1), last[:-1]])
    gap = rows - before
    known = seen & (before >= 0) & (gap * step <= max(_GAP, 1.5 * step))
    columns = np.arange(m)[None]
    here = markers[before, columns]
    speed = here - markers[before - 1, columns]
    speed[(before < 1) | ~np.isfinite(speed).all(axis=2)] = 0.0
    ahead = here + gap[..., None] * speed
    with np.errstate(invalid="ignore"):
        jump = np.minimum(_norm(markers - here), _norm(markers - ahead))
    jump[~known] = 0.0
    events: dict[tuple[int, int], list[int]] = {}
    alone: dict[int, list[int]] = {}
    for t in np.flatnonzero((jump > _SHORTEST).any(axis=1)):
        found = np.flatnonzero(jump[t] > _SHORTEST)
        pairs = _turned(here[t, found], markers[t, found])
        for i, j in np.argwhere(np.triu(pairs, 1)):
            pair = int(found[i]), int(found[j])
            events.setdefault(pair, []).append(int(t))
        hard = jump[t, found] > np.maximum(
            _ASTRAY, _HARDEST * (gap[t, found] * step) ** 2
        )
        for i in np.flatnonzero(hard & ~pairs.any(axis=1)):
            alone.setdefault(int(found[i]), []).append(int(t))
    return Jumps(
        {pair: _between(at, n) for pair, at in events.items()},
        {marker: _between(at, n) for marker, at in alone.items()},
    )


def _turned(before: Array, now: Array) -> Mask:
    """Which two of K markers, (K, 3) m each, have changed places, (K, K).

    The line from one to the other points the other way, and its middle stays nearby: so
    it does not matter how the two move meanwhile. Of several, the best match counts.
    """
    line = before[:, None] - before[None]
    apart = _norm(line)
    over = _norm(line + now[:, None] - now[None])
    way = now - before
    middle = _norm(way[:, None] + way[None]) / 2
    limit = _EXCHANGED * apart
    likely = (over < limit) & (middle < np.maximum(limit, _ASTRAY))
    likely &= apart > _SHORTEST
    score = np.where(likely, over / np.maximum(apart, _SHORTEST), np.inf)
    best = score == score.min(axis=1, keepdims=True)
    return np.asarray(likely & best & best.T)


def _between(events: list[int], n: int) -> Mask:
    """Frames between the first and the second event, the third and the fourth, ...

    Of the two ways to count, the one with fewer frames.
    """
    flips = np.zeros(n, dtype=np.int64)
    np.add.at(flips, events, 1)
    inside = np.cumsum(flips) % 2 == 1
    return ~inside if inside.mean() > 0.5 else inside


def _norm(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
