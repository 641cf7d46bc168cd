"""Velocity from sampled values."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Mask

#: Width of the fit, s; voluntary motion of the arm is below about 5 Hz.
WINDOW = 0.2
#: Most variance of a slope next to a gap, over that at the end of a recording, where
#: the whole window lies on one side. Twice leaves out the 2 samples next to a long gap,
#: of a window of 21, and keeps those around a short one.
_MOST_VARIANCE = 2.0
#: Samples that are worked on at a time, which bounds the memory.
_BATCH = 2048


def slope(values: Array, time: Array, known: Mask | None = None) -> Array:
    """Time derivative by a moving parabola (Savitzky and Golay 1964).

    Of values (T, ...) at evenly spaced times (T,), s. The parabola is fitted over
    ``WINDOW`` around each sample, to the known values there; by default all are. NaN
    where the value is unknown, where too few others are known, and for a single sample.

    >>> import numpy as np
    >>> time = np.arange(100) / 100
    >>> slope(3 * time, time)[50].round(9)
    np.float64(3.0)
    """
    if len(time) < 2:
        return np.full_like(values, np.nan)
    step = float(time[-1] - time[0]) / (len(time) - 1)
    window = 2 * round(WINDOW / step / 2) + 1
    window = min(window, len(time) - 1 + len(time) % 2)
    if known is None or known.all():
        known = None
    else:
        values = np.where(known, values, 0.0)
    if window < 5:
        found = np.asarray(np.gradient(values, step, axis=0))
        if known is not None:
            around = known.astype(np.float64)
            around[1:] *= known[:-1]
            around[:-1] *= known[1:]
            found[around == 0] = np.nan
        return found
    found = _parabola_slopes(values, window, step)
    if known is None:
        return found
    columns, rows = found.reshape(len(time), -1), values.reshape(len(time), -1)
    masks = known.reshape(columns.shape).T
    alike: dict[bytes, list[int]] = {}
    for column, mask in enumerate(masks):
        alike.setdefault(mask.tobytes(), []).append(column)
    for own in alike.values():
        _mend(columns, rows, masks[own[0]], own, window, step)
    return columns.reshape(values.shape)


def _parabola_slopes(values: Array, window: int, step: float) -> Array:
    """Slopes where all values (T, ...) are known, T at least the window.

    The window lies around a sample, at the ends of the recording within it. The same as
    ``scipy.signal.savgol_filter(values, window, 2, deriv=1, delta=step, axis=0)``,
    whose import takes longer than most commands.
    """
    half = window // 2
    at = (np.arange(window) - np.arange(window)[:, None]) / half
    weights, _ = _weights(at, np.ones((window, window), dtype=bool))
    weights /= half * step
    # By pairs: those of the middle are antisymmetric, but for rounding.
    found = np.zeros(values.shape)
    middle = found[half:-half]
    for k in range(half):
        far = values[window - 1 - k : len(values) - k]
        middle += weights[half, -1 - k] * (far - values[k : k + len(middle)])
    found[:half] = np.tensordot(weights[:half], values[:window], axes=1)
    found[-half:] = np.tensordot(weights[-half:], values[-window:], axes=1)
    return found


def _mend(
    found: Array,
    values: Array,
    known: Mask,
    columns: list[int],
    window: int,
    step: float,
) -> None:
    """Write the slopes of columns again where the window has unknown samples."""
    found.T[columns] = np.where(known, found.T[columns], np.nan)
    half = window // 2
    first = np.clip(np.arange(len(known)) - half, 0, len(known) - window)
    before = np.r_[0, np.cumsum(~known)]
    touched = np.flatnonzero(known & (before[first + window] > before[first]))
    end = np.arange(window) / half
    _, worst = _weights(end[None], np.ones((1, window), dtype=bool))
    for batch in np.split(touched, range(_BATCH, len(touched), _BATCH)):
        at = first[batch, None] + np.arange(window)
        weights, variance = _weights((at - batch[:, None]) / half, known[at])
        fitted = np.einsum("bw,bwc->bc", weights, values[at][..., columns])
        fitted /= half * step
        fitted[~(variance <= _MOST_VARIANCE * worst)] = np.nan
        found[batch[:, None], columns] = fitted


def _weights(x: Array, known: Mask) -> tuple[Array, Array]:
    """Of values at x (N, w) in the slope at 0 of their parabola, and its variance.

    Of values with a variance of 1; NaN where fewer than three are known.
    """
    one = known.astype(np.float64)
    moved = one * x
    square = moved * x
    s0, s1, s2 = one.sum(axis=1), moved.sum(axis=1), square.sum(axis=1)
    s3, s4 = (square * x).sum(axis=1), (square * square).sum(axis=1)
    # The middle row of the inverse of the normal equations' matrix.
    row = s2 * s3 - s1 * s4, s0 * s4 - s2 * s2, s1 * s2 - s0 * s3
    determinant = s1 * row[0] + s2 * row[1] + s3 * row[2]
    determinant[s0 < 3] = np.nan
    a, b, c = (entry / determinant for entry in row)
    return a[:, None] * one + b[:, None] * moved + c[:, None] * square, b
