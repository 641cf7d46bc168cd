"""Markers that move on the skin at one moment: knocked, or put on again.

Skin stretches over tenths of a second. Where distances within a segment change from one
frame to the next and stay so, a marker sits somewhere else from then on.
"""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices
from ikns.calibration.judge.finding import Finding

#: Least step of a distance, m: from one frame to the next, and of the medians of so
#: many frames before and after.
_STEP, _BESIDE = 0.008, 10
#: Steps that are named; a marker that flickers is told as a ghost.
_MOST = 3


def find_steps(apart: Array, pairs: Indices) -> list[tuple[int, int, float]]:
    """Find frames from which on a marker sits elsewhere on its segment.

    Parameters
    ----------
    apart : (T, N) array
        Distances of pairs, m; NaN where not seen.
    pairs : (N, 2) integer array
        Markers of one segment each.

    Returns
    -------
    list of (frame, marker, change)
        The change is the largest of its distances to the others, m.
    """
    if len(apart) < 2 * _BESIDE or not len(pairs):
        return []
    with np.errstate(invalid="ignore"):
        jump = np.abs(np.diff(apart, axis=0))
        sudden = jump > _STEP
    found: list[tuple[int, int, float]] = []
    for t in (np.flatnonzero(sudden.any(axis=1)) + 1).tolist():
        if not _BESIDE <= t <= len(apart) - _BESIDE:
            continue
        own = np.flatnonzero(sudden[t - 1])
        before, after = apart[t - _BESIDE : t, own], apart[t : t + _BESIDE, own]
        seen = np.isfinite(before).any(axis=0) & np.isfinite(after).any(axis=0)
        if not seen.any():
            continue
        change = np.abs(
            np.nanmedian(after[:, seen], axis=0) - np.nanmedian(before[:, seen], axis=0)
        )
        if change.max() <= _STEP:
            continue
        total = np.bincount(pairs[own[seen]].ravel(), np.repeat(change, 2))
        step = (t, int(total.argmax()), float(change.max()))
        if found and t - found[-1][0] < _BESIDE and _same(pairs, step[1], found[-1][1]):
            # Noise can make another jump next to it: the larger one is the step.
            if np.nanmax(jump[t - 1]) <= np.nanmax(jump[found[-1][0] - 1]):
                continue
            found.pop()
        found.append(step)
    return found


def _same(pairs: Indices, a: int, b: int) -> bool:
    """Whether two markers sit on one segment."""
    return a == b or bool(((pairs == a) | (pairs == b)).all(axis=1).any())


def judge_steps(
    where: str, labels: tuple[str, ...], time: Array, apart: Array, pairs: Indices
) -> list[Finding]:
    """Say which markers sit elsewhere from a frame on; arguments as above."""
    steps = find_steps(apart, pairs)
    if len(steps) > _MOST:
        return []
    return [
        Finding(
            "marker moved",
            "warn",
            where,
            f"{labels[marker]} moved on its segment, {1000 * change:.0f} mm relative "
            "to the others,",
            f"use the part before it, for example with --to {time[t - 1]:g}, and "
            "calibrate again for the rest",
            (labels[marker],),
            f"{t + 1}",
        )
        for t, marker, change in steps
    ]
