"""Traces that no camera measured: stand-in numbers, frozen markers, filled gaps."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Mask

#: Two markers are never this close, m: half of the smallest sold, 1.5 mm. Recordings
#: name one place twice when they write a number for "not seen".
_SAME_PLACE = 1e-6
#: No one is this far from the middle of the markers, m.
_FAR = 15.0
#: A marker is frozen when all three coordinates stay equal for so long, s and frames,
#: while the nearest markers go this far, m.
_FROZEN_TIME, _FROZEN_FRAMES, _OTHERS_MOVE = 0.25, 10, 0.02
#: How many of the nearest markers, each seen in this share of the frames.
_NEAREST, _SEEN = 3, 0.5
#: A line that a program drew: positions differ from it by less than this, m, over the
#: same time, while the marker goes this far, m. Cameras have 20 times that noise, files
#: with three digits after the millimeter round to a tenth of it. A person's marker that
#: moved without noise would leave the line by 1 mm in that time at 0.13 m/s^2.
_STRAIGHT, _TRAVEL = 5e-6, 0.02
#: Between samples of which the second difference is taken, s: at 1000 Hz that of three
#: neighbors is as small for any movement.
_APART = 0.01


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
        for first, last in _runs(equal[:, column]):
            if last - first + 1 >= least and _others_move(markers, column, first, last):
                found[first : last + 1, column] = True
    return found


def straight(time: Array, markers: Array) -> Mask:
    """Where a marker moves in a line at constant speed, as a filled gap does, (T, M).

    Arguments as for :func:`ikns.calibration.judge.jumps.find_jumps`. Not where most of
    its neighbors do so too, as they were made then, not measured.
    """
    n, m = markers.shape[:2]
    found: Mask = np.zeros((n, m), dtype=bool)
    if n < 3:
        return found
    step = float(np.median(np.diff(time)))
    least = max(_FROZEN_FRAMES, round(_FROZEN_TIME / step))
    k = max(1, round(_APART / step))
    with np.errstate(invalid="ignore"):
        bend = np.abs(markers[2 * k :] - 2 * markers[k:-k] + markers[: -2 * k])
        even = np.asarray((bend <= _STRAIGHT).all(axis=2))
    for column in np.flatnonzero(even.sum(axis=0) >= least - 2 * k).tolist():
        for first, end in _runs(even[:, column]):
            run = slice(first, end + 2 * k)
            if run.stop - first >= least and _is_line(markers[run, column]):
                found[run, column] = True
    return np.asarray(found & (found.sum(axis=1, keepdims=True) <= m / 2))


def _runs(flags: Mask) -> list[tuple[int, int]]:
    """First entry of each run of true ones, and that after its last."""
    padded = np.concatenate([[0], flags.astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(padded)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _is_line(places: Array) -> bool:
    """Whether places (N, 3) lie evenly on the line from the first to the last."""
    line = np.linspace(places[0], places[-1], len(places))
    away, travel = np.abs(places - line).max(), np.linalg.norm(places[-1] - places[0])
    return bool(away <= 4 * _STRAIGHT and travel >= _TRAVEL)


def repeated(markers: Array) -> Mask:
    """Which frames are the one before to the last digit, all seen markers, (T,)."""
    again: Mask = np.zeros(len(markers), dtype=bool)
    # Few frames repeat even one coordinate of all, so only these are looked at in full.
    rows = np.flatnonzero(_same(markers[1:, :, 0], markers[:-1, :, 0]).all(axis=1)) + 1
    same = _same(markers[rows], markers[rows - 1]).all(axis=(1, 2))
    seen = np.isfinite(markers[rows]).all(axis=2).sum(axis=1) >= _NEAREST
    again[rows] = same & seen
    return again


def _same(a: Array, b: Array) -> Mask:
    return np.asarray((a == b) | (np.isnan(a) & np.isnan(b)))


def _others_move(markers: Array, column: int, first: int, last: int) -> bool:
    """Whether the nearest markers all moved during these frames."""
    span = markers[first : last + 1]
    away = np.linalg.norm(span - span[:, [column]], axis=2)
    seen = np.isfinite(away).mean(axis=0) >= _SEEN
    seen[column] = False
    near = np.flatnonzero(seen)
    near = near[np.argsort(np.nanmedian(away[:, near], axis=0))][:_NEAREST]
    shown = span[:, near]
    way = (np.nanmax(shown, axis=0) - np.nanmin(shown, axis=0)).max(axis=1)
    return len(near) == _NEAREST and bool((way > _OTHERS_MOVE).all())
