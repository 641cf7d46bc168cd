"""Traces of single markers that no camera measured: stand-in numbers, frozen ones."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Mask

#: Two markers are never this close, m: half of the smallest sold, 1.5 mm. Recordings
#: name one place twice when they write a number for "not seen".
_SAME_PLACE = 1e-6
#: Nobody is this far from the middle of the markers, m.
_FAR = 15.0
#: A marker is frozen when all three coordinates stay equal for so long, s and frames,
#: while the nearest markers go this far, m.
_FROZEN_TIME, _FROZEN_FRAMES, _OTHERS_MOVE = 0.25, 10, 0.02
#: How many of the nearest markers.
_NEAREST = 3


def stand_ins(markers: Array) -> Mask:
    """Where a position is a number that stands for "not seen", (T, M).

    All three coordinates are equal (0, -1, 9999999), two markers share one place, or
    the place is outside any room.

    Parameters
    ----------
    markers : (T, M, 3) array
        m; NaN where not seen.

    Examples
    --------
    >>> markers = np.random.default_rng(1).normal(size=(4, 5, 3))
    >>> markers[2, 1] = -16.512
    >>> np.argwhere(stand_ins(markers)).tolist()
    [[2, 1]]
    """
    seen: Mask = np.asarray(np.isfinite(markers).all(axis=2))
    x, y, z = np.moveaxis(markers, 2, 0)
    bad = seen & (x == y) & (y == z)
    # Most frames have no two equal numbers, so only the others are looked at in full.
    with np.errstate(invalid="ignore"):
        alike = (np.diff(np.sort(x, axis=1), axis=1) < _SAME_PLACE).any(axis=1)
    for t in np.flatnonzero(alike).tolist():
        order = np.flatnonzero(seen[t])[np.lexsort(markers[t, seen[t]].T)]
        equal = np.abs(np.diff(markers[t, order], axis=0)).max(axis=1) < _SAME_PLACE
        bad[t, order[1:][equal]] = bad[t, order[:-1][equal]] = True
    rest = np.where((seen & ~bad)[..., None], markers, np.nan)[
        :: len(markers) // 100 + 1
    ]
    if not np.isfinite(rest).any():
        return bad
    middle = np.nanmedian(rest.reshape(-1, 3), axis=0)
    with np.errstate(invalid="ignore"):
        far = np.zeros_like(seen)
        for values, usual in zip((x, y, z), middle, strict=True):
            far |= np.abs(values - usual) > _FAR
    # A volume so large that people walk through it: compare within the frame too.
    for t in np.flatnonzero((far & seen).any(axis=1)).tolist():
        here = markers[t, seen[t]]
        far[t] &= np.abs(markers[t] - np.median(here, axis=0)).max(axis=1) > _FAR
    return np.asarray(bad | (far & seen))


def frozen(time: Array, markers: Array) -> Mask:
    """Where a marker stands still to the last digit while its neighbors move, (T, M).

    Arguments as for :func:`ikns.calibration.judge.jumps.find_jumps`.
    """
    n, m = markers.shape[:2]
    found: Mask = np.zeros((n, m), dtype=bool)
    if n < 2:
        return found
    step = float(np.median(np.diff(time)))
    least = max(_FROZEN_FRAMES, round(_FROZEN_TIME / step))
    equal = markers[1:, :, 0] == markers[:-1, :, 0]
    for axis in (1, 2):
        equal &= markers[1:, :, axis] == markers[:-1, :, axis]
    for column in np.flatnonzero(equal.sum(axis=0) >= least - 1).tolist():
        padded = np.concatenate([[0], equal[:, column].astype(np.int8), [0]])
        edges = np.flatnonzero(np.diff(padded))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first + 1 >= least and _others_move(markers, column, first, last):
                found[first : last + 1, column] = True
    return found


def _others_move(markers: Array, column: int, first: int, last: int) -> bool:
    """Whether the nearest markers all moved during these frames."""
    span = markers[first : last + 1]
    away = np.linalg.norm(span - span[:, [column]], axis=2)
    seen = np.isfinite(away).all(axis=0)
    seen[column] = False
    near = np.flatnonzero(seen)
    near = near[np.argsort(away[0, near])][:_NEAREST]
    way = np.ptp(span[:, near], axis=0).max(axis=1)
    return len(near) == _NEAREST and bool((way > _OTHERS_MOVE).all())
