"""Markers that are late: filtered on their own, or from another clock.

A marker that is late by tau is where it was, p - tau v. Its distances to the others of
its segment then change with the speed at which it moves along them, -tau v . u, and so
do all of them at once. Skin moves with posture, not with speed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.calibration.judge.finding import Finding

#: Least share of the squared changes of a segment's distances that one late marker
#: explains to first order, and least lag, s; and how much of the variance may be left
#: once it is shifted. In clean recordings of seven people (1344 clusters in 168 trials)
#: one has more than 0.2 for a lag, and 0.26 of the variance left; with a marker 0.05 or
#: 0.2 s late, 0.3 or more, and 0.07 at most (benchmarks/silent_faults.py).
_EXPLAINED, _LATE, _LEFT = 0.2, 0.02, 0.15
#: Least change of the distances, root mean square, m.
_CHANGE = 5e-4
#: Frames looked at, and fewest; time over which speed is taken, s.
_GLANCES, _FEWEST, _STEP = 600, 30, 0.02
#: Longest lag that is looked for, s.
_LONGEST = 1.0


def late_marker(
    time: Array, markers: Array, pairs: Indices
) -> tuple[int, float, float] | None:
    """Find the one marker of a segment whose being late explains its distances.

    Parameters
    ----------
    time : (T,) array
        s, evenly spaced.
    markers : (T, M, 3) array
        m in the world; NaN = not seen.
    pairs : (N, 2) integer array
        Markers of this segment, two and two.

    Returns
    -------
    (marker, lag, explained) or None
        Lag to first order, s, positive where it is late, and the share of the squared
        changes of all distances. None where they do not change.
    """
    if len(time) < _FEWEST:
        return None
    period = (time[-1] - time[0]) / (len(time) - 1)
    step = max(1, round(_STEP / period))
    rows = np.arange(step, len(time) - step)
    rows = rows[:: max(1, -(-len(rows) // _GLANCES))]
    if len(rows) < _FEWEST:
        return None
    i, j = pairs.T
    speed = (markers[rows + step] - markers[rows - step]) / (2 * step * period)
    line = markers[rows][:, i] - markers[rows][:, j]
    apart = np.linalg.norm(line, axis=2)
    unit = line / np.maximum(apart, 1e-9)[..., None]
    # Change of the distance for each second that the first, the second marker is late.
    first = -np.einsum("tpi,tpi->tp", unit, speed[:, i])
    second = np.einsum("tpi,tpi->tp", unit, speed[:, j])
    known = np.isfinite(apart + first + second)
    count = known.sum(axis=0)
    own = count >= _FEWEST
    if not own.any():
        return None

    def centered(values: Array) -> Array:
        kept = np.where(known, values, 0.0)
        middle = kept.sum(axis=0) / np.maximum(count, 1)
        return np.where(known & own, values - middle, 0.0)

    change, first, second = centered(apart), centered(first), centered(second)
    total = float(np.sum(change**2))
    if total < _CHANGE**2 * count[own].sum():
        return None
    m = markers.shape[1]
    right = np.bincount(i, (first * change).sum(axis=0), m)
    right += np.bincount(j, (second * change).sum(axis=0), m)
    normal = np.bincount(i, (first**2).sum(axis=0), m)
    normal += np.bincount(j, (second**2).sum(axis=0), m)
    lag = right / np.maximum(normal, 1e-12)
    gain = lag * right / total
    best = int(gain.argmax())
    return best, float(lag[best]), float(gain[best])


def judge_lags(
    where: str, labels: Sequence[str], time: Array, markers: Array, pairs: Indices
) -> list[Finding]:
    """Say which marker is late; arguments as above, pairs of all segments."""
    findings = []
    for own in _segments(pairs):
        found = late_marker(time, markers, own)
        if found is None or found[2] < _EXPLAINED or abs(found[1]) < _LATE:
            continue
        marker = found[0]
        lag = _best_lag(time, markers, own, marker)
        if abs(lag) < _LATE:
            continue
        findings.append(
            Finding(
                "late",
                "warn",
                where,
                f"{labels[marker]} is {abs(lag):.2f} s {'late' if lag > 0 else 'early'}"
                ": its distances to the other markers of its segment change with its "
                "speed",
                "export all markers with one clock and one filter",
                (labels[marker],),
            )
        )
    return findings


def _best_lag(time: Array, markers: Array, pairs: Indices, marker: int) -> float:
    """Lag at which a marker's distances to the others vary least, s; 0 if in vain."""
    period = (time[-1] - time[0]) / (len(time) - 1)
    others = np.setdiff1d(pairs[(pairs == marker).any(axis=1)], [marker])
    most = min(round(_LONGEST / period), len(time) // 3)
    shifts = np.arange(-most, most + 1)
    middle = slice(most, len(time) - most)
    rest = markers[middle][:, others]
    left = np.full(len(shifts), np.inf)
    for k, shift in enumerate(shifts.tolist()):
        own = markers[most + shift : len(time) - most + shift, marker]
        apart = np.linalg.norm(rest - own[:, None], axis=2)
        if np.isfinite(apart).all(axis=1).sum() >= _FEWEST:
            left[k] = float(np.nansum(np.nanvar(apart, axis=0)))
    best = int(left.argmin())
    return float(shifts[best] * period) if left[best] < _LEFT * left[most] else 0.0


def _segments(pairs: Indices) -> list[Indices]:
    """Pairs of each segment, of three markers or more: of two, neither is the late."""
    group: dict[int, int] = {}
    for a, b in pairs.tolist():
        group[b] = group.setdefault(a, a)
    heads = np.array([group[a] for a in pairs[:, 0].tolist()], dtype=np.int64)
    found = [pairs[heads == head] for head in dict.fromkeys(heads.tolist())]
    return [own for own in found if len(np.unique(own)) > 2]
