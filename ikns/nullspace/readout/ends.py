"""The ends of a range that was swept while noise ran along.

The extremes of n noisy samples lie beyond those of the motion, the farther the more
samples and the more noise there are, so that c is compressed. Here every sample is
first replaced by a local quadratic in time, which keeps a turning point and averages
noise over its width; what noise is left in the extremes is measured by adding as much
again, and taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices, Mask
from ikns.errors import InvalidInput

#: Half width of the local quadratic, s: a sweep of 30 deg at 1 Hz loses 0.1 deg of a
#: turning point (its fourth derivative times 3/35 h^4 / 24), and at the unhurried 0.5
#: Hz a hundredth of that.
_HALF_WIDTH = 0.15
#: Samples in a window at least this many, else they are taken as they are.
_LEAST = 5
#: A sample so many times the noise off its neighbors is a jump, not motion.
_JUMP = 5.0
#: Draws of noise that measure what it adds to the extremes: their mean is then known to
#: a sixth of its spread.
_DRAWS = 40

#: Of the biweight mean; it converges in about ten rounds.
_TUKEY, _ROUNDS = 4.685, 100
_EPS = float(np.finfo(float).eps)


class SweptEnds(NamedTuple):
    """Ends of a sweep, and the noise of a single sample, in the unit of the values."""

    lower: float
    upper: float
    noise: float


def swept_ends(
    values: ArrayLike, time: ArrayLike, *, seed: int | np.random.Generator = 0
) -> SweptEnds:
    """Lowest and highest point of a motion that was measured with noise.

    Parameters
    ----------
    values : (N,) array
        What was measured; the noise of samples is taken as independent.
    time : (N,) array
        s, increasing; there may be gaps.
    seed : int or Generator
        Of the draws of noise.

    Raises
    ------
    InvalidInput
        When there is no sample, one is not finite, or time does not increase.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> time = np.arange(500) / 100
    >>> swept = np.sin(3 * time) + 0.1 * rng.normal(size=500)
    >>> bool(swept.max() > 1.15), swept_ends(swept, time).upper.__round__(1)
    (True, 1.0)
    """
    y, t = np.asarray(values, dtype=np.float64), np.asarray(time, dtype=np.float64)
    if y.ndim != 1 or not y.size or y.shape != t.shape:
        raise InvalidInput(
            f"expected values and times (N,) with a sample at least, found {y.shape} "
            f"and {t.shape}."
        )
    t = checked_times(t, len(y))
    if not np.isfinite(y).all():
        raise InvalidInput("expected finite values, found some that are not.")
    windows = _windows(t)
    smooth = windows.smooth(y)
    noise = _noise(y - smooth, windows.share)
    steady = np.abs(y - smooth) <= _JUMP * noise
    if noise > 0 and not steady.all() and steady.sum() >= _LEAST:
        y, t = y[steady], t[steady]
        windows = _windows(t)
        smooth = windows.smooth(y)
        noise = _noise(y - smooth, windows.share)
    rng = np.random.default_rng(seed)
    drawn = windows.smooth(smooth + noise * rng.normal(size=(_DRAWS, len(y))))
    # A quadratic of the smoothed series is the base: its bias at a turn is no noise.
    plain = windows.smooth(smooth)
    low = smooth.min() - (drawn.min(axis=1).mean() - plain.min())
    high = smooth.max() - (drawn.max(axis=1).mean() - plain.max())
    return SweptEnds(float(min(low, high)), float(max(low, high)), noise)


def swept_ends_of(values: Array, time: Array, rows: Sequence[Indices]) -> Array:
    """Return the ends for several sets of rows of a series, (P, 2)."""
    return np.array([swept_ends(values[row], time[row])[:2] for row in rows])


def robust_mean(values: ArrayLike) -> float:
    """Tukey's biweight mean: the mean of what agrees, outliers left out.

    Weights are ``(1 - r^2)^2`` with r the distance in units of 4.685 robust standard
    deviations (Beaton and Tukey 1974), 0 beyond; of normal values it is as good as the
    mean of 95 % of them.

    Examples
    --------
    >>> robust_mean([1.0, 1.1, 0.9, 1.0, 7.0])
    1.0
    """
    x = np.asarray(values, dtype=np.float64)
    middle = float(np.median(x))
    for _ in range(_ROUNDS):
        # 1.4826 median deviations are a standard deviation of normal values.
        width = _TUKEY * 1.4826 * float(np.median(np.abs(x - middle)))
        if width <= _EPS * float(np.abs(x).max()):
            break  # most are the same
        weight = np.clip(1 - ((x - middle) / width) ** 2, 0, None) ** 2
        before, middle = middle, float(weight @ x / weight.sum())
        if abs(middle - before) <= 1e-12 * width:
            break
    return middle


def checked_times(time: ArrayLike, n: int) -> Array:
    """Return times as an array (n,) s; they must be finite and increase."""
    t = np.asarray(time, dtype=np.float64)
    if t.shape != (n,) or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise InvalidInput(
            f"expected {n} finite times that increase, one for each sample, found "
            f"an array {t.shape}."
        )
    return t


def local_quadratic(values: Array, time: Array) -> tuple[Array, Array]:
    """Quadratic fit around each sample, at the sample (Savitzky and Golay 1964).

    Parameters
    ----------
    values : (..., N) array
    time : (N,) array
        s, increasing; samples within 0.15 s to both sides count, gaps or not.

    Returns
    -------
    smooth : (..., N) array
        The values themselves where fewer than five samples are near.
    share : (N,) array
        Weight of a sample in its own fit; its variance in units of that of a sample.
    """
    windows = _windows(time)
    return windows.smooth(values), windows.share


class _Windows(NamedTuple):
    """Samples near each of N samples, as far as K / 2 places before and after it."""

    weights: Array  # (K, 3, N): 1, u, u^2; 0 where that sample is not near
    row: Array  # (N, 3), of the inverse normal equations: the value at the sample
    enough: Mask  # (N,), whether there is a fit

    @property
    def share(self) -> Array:
        return np.where(self.enough, self.row[:, 0], 1.0)

    def smooth(self, values: Array) -> Array:
        """Evaluate the fit to values (..., N) at each sample."""
        reach = len(self.weights) // 2
        padding = [(0, 0)] * (values.ndim - 1) + [(reach, reach)]
        padded = np.pad(values, padding, mode="edge")
        sums = np.zeros((3, *values.shape))
        part = np.empty(values.shape)
        for k, weight in enumerate(self.weights):
            near = padded[..., k : k + values.shape[-1]]
            for total, power in zip(sums, weight, strict=True):
                total += np.multiply(power, near, out=part)
        smooth = np.einsum("np,p...n->...n", self.row, sums)
        return np.where(self.enough, smooth, values)


def _windows(time: Array) -> _Windows:
    n = len(time)
    first = np.searchsorted(time, time - _HALF_WIDTH)
    last = np.searchsorted(time, time + _HALF_WIDTH, side="right")
    here = np.arange(n)
    reach = int(max((here - first).max(), (last - 1 - here).max()))
    at = here + np.arange(-reach, reach + 1)[:, None]
    near = (at >= first) & (at < last)
    # In units of the half width: all moments are then of one order.
    u = np.where(near, (time[np.clip(at, 0, n - 1)] - time) / _HALF_WIDTH, 0.0)
    powers = [near.astype(float)]
    for _ in range(4):
        powers.append(powers[-1] * u)
    moments = np.array([power.sum(axis=0) for power in powers])
    normal = moments[np.add.outer(np.arange(3), np.arange(3))].transpose(2, 0, 1)
    enough = (last - first >= _LEAST) & (np.linalg.det(normal) > 1e-9)
    normal[~enough] = np.eye(3)
    row = np.linalg.inv(normal)[:, 0]
    return _Windows(np.stack(powers[:3], axis=1), row, enough)


def _noise(rest: Array, share: Array) -> float:
    """Noise of a sample from residuals, robust against jumps."""
    free = share < 1
    if not free.any():
        return 0.0
    # The median of |normal| is 0.6745 of its standard deviation.
    return float(np.median(np.abs(rest[free]) / np.sqrt(1 - share[free])) / 0.6745)
