"""How well a pointer followed: error, lag, overshoot, smoothness; y is 0 to 100."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.experiments.tracking.profiles import Profile
from ikns.experiments.tracking.trial import TrackingRecord

#: Trials are resampled to this rate for lag and smoothness, 1/s.
RATE = 100.0
#: Longest lag or lead searched for, s: people follow within half a second.
LONGEST_LAG = 1.5
#: Cut-off of the low-pass before smoothness, Hz: voluntary tracking lies below. The
#: noise above would make the result depend on which of its frequencies happen to exceed
#: the amplitude threshold.
_VOLUNTARY_HZ = 5.0
#: Highest frequency (Hz) and smallest amplitude of the spectral arc length, and power
#: of two by which the signal is zero-padded: the authors' values.
_HIGHEST_HZ, _SMALLEST, _PADDING = 10.0, 0.05, 4


@dataclass(frozen=True)
class Metrics:
    """Metrics of a trial, from the profile's beginning to its end.

    Parameters
    ----------
    rmse, mae : float
        Root mean square and mean absolute error, of 100, over the samples (as in the
        paper).
    lag : float
        How far the pointer lags behind, s; NaN where it never moved.
    correlation : float
        With the target at that lag.
    overshoot : float
        Mean overshoot at the end of the profile's moves, of 100.
    smoothness, target_smoothness : float
        Spectral arc length of the pointer and of the profile, negative; the nearer to
        0 the smoother. It is lower for longer profiles with more moves, so compare it
        with that of the target.
    unseen : float
        Share of samples without a control signal, in which the pointer stood still.
    samples : int
    """

    rmse: float
    mae: float
    lag: float
    correlation: float
    overshoot: float
    smoothness: float
    target_smoothness: float
    unseen: float
    samples: int


def measure(record: TrackingRecord) -> Metrics:
    """Compute all metrics of a trial.

    Raises
    ------
    NotEnoughData
        With no c before the profile's end, or less than a second of it.
    """
    time, y = record.time, record.y
    kept = (time >= 0) & np.isfinite(y)
    if kept.sum() < 2 or np.ptp(time[kept]) < 1.0:
        raise NotEnoughData(
            "expected at least a second of a tracking trial with a control signal, "
            f"found {int(kept.sum())} samples."
        )
    error = y[kept] - record.target[kept]
    # Correlation and spectrum need even spacing, which frames have only nearly.
    first, last = time[kept][[0, -1]]
    even = first + np.arange(int((last - first) * RATE) + 1) / RATE
    pointer = np.interp(even, time[kept], y[kept])
    target = record.profile.at(even)
    behind, correlation = lag(target, pointer, rate=RATE)
    from scipy.signal import butter, sosfiltfilt  # slow to load

    smooth = butter(2, _VOLUNTARY_HZ, fs=RATE, output="sos")
    moved = sosfiltfilt(smooth, np.gradient(pointer, 1 / RATE))
    meant = sosfiltfilt(smooth, record.profile.speed(even))
    return Metrics(
        rmse=float(np.sqrt(np.mean(error**2))),
        mae=float(np.mean(np.abs(error))),
        lag=behind,
        correlation=correlation,
        overshoot=float(np.mean(overshoot(record.profile, time[kept], y[kept]))),
        smoothness=spectral_arc_length(moved, rate=RATE),
        target_smoothness=spectral_arc_length(meant, rate=RATE),
        unseen=float(np.mean(~np.isfinite(record.c[time >= 0]))),
        samples=int(kept.sum()),
    )


def lag(
    target: ArrayLike, follower: ArrayLike, *, rate: float, longest: float = LONGEST_LAG
) -> tuple[float, float]:
    """Lag of one signal behind another, by cross-correlation.

    The Pearson correlation is taken over the overlap at each shift, so that neither the
    level nor the length of the overlap matters; a parabola through the peak gives the
    lag between samples.

    Parameters
    ----------
    target, follower : (T,) array
    rate : float
        Samples per second.
    longest : float
        Largest shift either way, s; at most half of the signals.

    Returns
    -------
    lag : float
        s; negative where the follower leads. NaN where one of them never moves.
    correlation : float
        At the best whole sample.

    Examples
    --------
    >>> t = np.arange(1000) / 100
    >>> behind, _ = lag(np.sin(3 * t), np.sin(3 * (t - 0.234)), rate=100)
    >>> round(behind, 3)
    0.234
    """
    a, b = (np.asarray(x, dtype=np.float64) for x in (target, follower))
    if a.shape != b.shape or a.ndim != 1 or len(a) < 4:
        raise InvalidInput(
            f"expected two signals of one length, found {a.shape} and {b.shape}."
        )
    limit = min(int(round(longest * rate)), len(a) // 2)
    found = np.array(
        [
            _pearson(
                a[max(0, -k) : len(a) - max(0, k)], b[max(0, k) : len(b) + min(0, k)]
            )
            for k in range(-limit, limit + 1)
        ]
    )
    if not np.isfinite(found).any():
        return np.nan, np.nan
    best = int(np.nanargmax(found))
    shift = float(best - limit)
    if 0 < best < len(found) - 1:
        before, here, after = found[best - 1 : best + 2]
        bend = before - 2 * here + after
        if bend < 0:  # false for NaN
            shift += 0.5 * (before - after) / bend
    return float(shift / rate), float(found[best])


def overshoot(profile: Profile, time: ArrayLike, y: ArrayLike) -> Array:
    """Overshoot of the pointer at the end of each move, before the next one begins.

    Parameters
    ----------
    profile : Profile
    time, y : (T,) array
        s, 0 to 100.

    Returns
    -------
    (K,) array
        0 where the pointer did not reach the end.
    """
    t, height = np.asarray(time), np.asarray(y)
    ends = np.append(profile.start[1:], profile.seconds)
    past = np.zeros(len(profile.start))
    way = np.sign(np.diff(profile.levels))
    for k, (begin, end) in enumerate(zip(profile.start, ends, strict=True)):
        inside = (t >= begin) & (t <= end)
        beyond = way[k] * (height[inside] - profile.levels[k + 1])
        past[k] = np.max(beyond, initial=0.0)
    return past


def spectral_arc_length(velocity: ArrayLike, *, rate: float) -> float:
    """Smoothness of a movement: minus the arc length of its speed's spectrum.

    S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami and E. Burdet (2015), On the
    analysis of movement smoothness, J. NeuroEng. Rehabil. 12:112 (SPARC). It depends
    neither on the size of the movement nor on its speed, and little on noise.

    Parameters
    ----------
    velocity : (T,) array
        Evenly sampled; its absolute value is used.
    rate : float
        Samples per second, more than 20.

    Returns
    -------
    float
        Negative; NaN without movement.
    """
    speed = np.abs(np.asarray(velocity, dtype=np.float64))
    if speed.ndim != 1 or len(speed) < 2 or not rate > 2 * _HIGHEST_HZ:
        raise InvalidInput(
            f"expected a signal at more than {2 * _HIGHEST_HZ:g} samples per second, "
            f"found {speed.shape} at {rate:g}."
        )
    if not speed.sum() > 0:
        return np.nan
    n = 2 ** (int(np.ceil(np.log2(len(speed)))) + _PADDING)
    size = np.abs(np.fft.rfft(speed, n))
    hertz = np.arange(len(size)) * rate / n
    low = hertz <= _HIGHEST_HZ
    size, hertz = size[low] / size[0], hertz[low]
    last = np.flatnonzero(size >= _SMALLEST)[-1] + 1
    steps = np.diff(hertz[:last]) / (hertz[last - 1] - hertz[0])
    return -float(np.sum(np.hypot(steps, np.diff(size[:last]))))


def error_over_time(
    records: Sequence[TrackingRecord], *, rate: float = 20.0
) -> tuple[Array, Array]:
    """Error of every trial on one time axis, to compare trials and subjects.

    Parameters
    ----------
    records : sequence of TrackingRecord
        Of profiles of one length.
    rate : float
        Samples per second of the result.

    Returns
    -------
    time : (T,) array
        From the profile's beginning, s.
    error : (N, T) array
        Pointer minus target; NaN outside of the recorded time.
    """
    lengths = {record.profile.seconds for record in records}
    if len(lengths) != 1:
        raise InvalidInput(
            f"expected trials of one length, found {sorted(lengths) or 'none'}."
        )
    time = np.arange(int(lengths.pop() * rate) + 1) / rate
    error = np.full((len(records), len(time)), np.nan)
    for row, record in zip(error, records, strict=True):
        known = np.isfinite(record.y)
        if known.any():
            y = np.interp(time, record.time[known], record.y[known], np.nan, np.nan)
            row[:] = y - record.profile.at(time)
    return time, error


def _pearson(a: Array, b: Array) -> float:
    u, v = a - a.mean(), b - b.mean()
    size = float(np.sqrt((u @ u) * (v @ v)))
    # Variation within rounding is not a movement.
    least = (
        len(a) * (1e-9 * max(1.0, float(np.abs(a).max()), float(np.abs(b).max()))) ** 2
    )
    return float(u @ v) / size if min(u @ u, v @ v) > least else np.nan
