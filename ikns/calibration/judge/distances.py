"""Distances of markers over time: the same segment's hardly change.

Where they do, a marker moved on the skin or carries another's name; where exchanging
two names makes all of them steady, these two are exchanged.
"""

from __future__ import annotations

from itertools import permutations
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices, Mask

#: Frames looked at, evenly spaced: enough for medians, and 2 ms.
_GLANCES = 60
#: Largest change of a distance within a segment that the skin causes, m: median over
#: a recording against the static trial, and 90th percentile over its frames. Real
#: people's: 16 and 24 mm (benchmarks/stray_marker.py, wrong_recordings.py).
MOST_CHANGE = 0.02
MOST_SPREAD = 0.03
#: An exchange must leave this share of the squared changes, or less.
_LEFT = 0.25
#: No change counts for more, m: how far is not the question.
_CAP = 0.2
#: Exchanges named one after the other.
_MOST_EXCHANGES = 3
#: Markers of one segment whose names are tried in every order; 120 orders.
_MOST_ORDERED = 5


class Distances(NamedTuple):
    """Distance of every two of M markers over the frames of a recording."""

    middle: Array  # (M, M) median, m; NaN where never seen together
    spread: Array  # (M, M) 90th percentile of how much it differs from that, m


def all_distances(markers: Array) -> Distances:
    """Measure all distances in markers (T, M, 3), m; NaN where not seen."""
    step = max(1, -(-len(markers) // _GLANCES))
    some = markers[::step]
    m = some.shape[1]
    first, second = np.triu_indices(m, 1)
    apart = np.linalg.norm(some[:, first] - some[:, second], axis=2)
    middle, spread = np.full((m, m), np.nan), np.full((m, m), np.nan)
    values = quantile(apart, 0.5)
    middle[first, second] = middle[second, first] = values
    values = quantile(np.abs(apart - values), 0.9)
    spread[first, second] = spread[second, first] = values
    return Distances(middle, spread)


def quantile(values: Array, share: float) -> Array:
    """Quantile of the finite values over time, (T, P) to (P,); far faster than NumPy's.

    The lower of two neighbors.
    """
    count = np.isfinite(values).sum(axis=0)
    at = np.maximum(0, np.floor(share * (count - 1)).astype(np.int64))
    found = np.sort(values, axis=0)[at, np.arange(values.shape[1])]
    return np.asarray(np.where(count > 0, found, np.nan))


def changed_pairs(found: Distances, pairs: Indices, worn: Array | None) -> Array:
    """How much each pair's distance changes, (N,) m; NaN where never seen together.

    Pairs (N, 2) lie on one segment each; `worn` (N,) are their distances on the person,
    None where these are not known.
    """
    i, j = pairs.T
    return _changes(found, i, j, worn)


def _changes(found: Distances, i: Indices, j: Indices, worn: Array | None) -> Array:
    spread = found.spread[i, j] * (MOST_CHANGE / MOST_SPREAD)
    if worn is None:
        return spread
    return np.asarray(np.fmax(np.abs(found.middle[i, j] - worn), spread))


def exchanged_by_distance(
    found: Distances, pairs: Indices, worn: Array | None
) -> tuple[list[tuple[int, int]], Mask]:
    """Find exchanges of two markers each that make all distances steady.

    Arguments as for :func:`changed_pairs`. Returns the exchanges, best first, and which
    pairs still change too much after them.
    """
    m = len(found.middle)
    names = np.arange(m)
    exchanges: list[tuple[int, int]] = []
    changes = changed_pairs(found, pairs, worn)
    while (changes > MOST_CHANGE).any() and len(exchanges) < _MOST_EXCHANGES:
        suspects = np.unique(pairs[changes > MOST_CHANGE])
        a, b = np.array(
            [(x, y) for x in suspects for y in range(m) if x != y], dtype=np.int64
        ).T
        trial = np.tile(names, (len(a), 1))
        rows = np.arange(len(a))
        trial[rows, a], trial[rows, b] = names[b], names[a]
        after = _changes(found, trial[:, pairs[:, 0]], trial[:, pairs[:, 1]], worn)
        # What cannot be compared after the exchange must not make it look better.
        cost = np.where(np.isnan(after), changes, after)
        total = np.nansum(np.minimum(cost, _CAP) ** 2, axis=1)
        best = int(np.argmin(total))
        if total[best] > _LEFT * np.nansum(np.minimum(changes, _CAP) ** 2):
            break
        names, changes = trial[best], after[best]
        exchanges.append((int(min(a[best], b[best])), int(max(a[best], b[best]))))
    if not exchanges and (changes > MOST_CHANGE).any():
        exchanges, changes = _gone_round(found, pairs, worn, changes)
    with np.errstate(invalid="ignore"):
        return exchanges, np.asarray(changes > MOST_CHANGE)


def _gone_round(
    found: Distances, pairs: Indices, worn: Array | None, changes: Array
) -> tuple[list[tuple[int, int]], Array]:
    """Find a segment whose names were permuted in a cycle; no single exchange helps.

    Returns exchanges that mend it one after the other, and the changes left.
    """
    m = len(found.middle)
    for own in _segments(pairs, m):
        inside = np.isin(pairs, own).all(axis=1)
        if (
            not 3 <= len(own) <= _MOST_ORDERED
            or not (changes[inside] > MOST_CHANGE).any()
        ):
            continue
        orders = np.array(list(permutations(own)))
        trial = np.tile(np.arange(m), (len(orders), 1))
        trial[:, own] = orders
        after = _changes(found, trial[:, pairs[:, 0]], trial[:, pairs[:, 1]], worn)
        after = np.where(np.isnan(after), changes, after)
        total = np.nansum(np.minimum(after[:, inside], _CAP) ** 2, axis=1)
        best = int(np.argmin(total))
        before = np.nansum(np.minimum(changes[inside], _CAP) ** 2)
        fits = not (after[best, inside] > MOST_CHANGE).any()
        if fits and total[best] <= _LEFT * before:
            return _as_exchanges(trial[best]), after[best]
    return [], changes


def _segments(pairs: Indices, m: int) -> list[Indices]:
    """Markers that pairs (N, 2) join, segment by segment."""
    group = np.arange(m)
    for a, b in pairs.tolist():
        group[group == group[b]] = group[a]
    return [np.flatnonzero(group == number) for number in np.unique(group)]


def _as_exchanges(names: Indices) -> list[tuple[int, int]]:
    """Exchanges of two entries each that turn 0, 1, 2, ... into this order."""
    now, done = np.arange(len(names)), []
    for i in range(len(names)):
        if now[i] != names[i]:
            j = int(np.flatnonzero(now == names[i])[0])
            now[[i, j]] = now[[j, i]]
            done.append((i, j))
    return done


def pair_distances(markers: Array, pairs: Indices) -> Array:
    """Distance of each of pairs (N, 2) in each of frames (T, M, 3), (T, N) m."""
    apart = markers[:, pairs[:, 0]] - markers[:, pairs[:, 1]]
    return np.asarray(np.sqrt(np.einsum("tpi,tpi->tp", apart, apart)))
