"""Running statistics of the error over time, in memory of fixed size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput

#: Range and bin width of the histograms of errors, of 100.
_FARTHEST, _BIN = 100.0, 0.5
_BINS = round(2 * _FARTHEST / _BIN)


@dataclass(frozen=True, eq=False)
class ErrorOverTime:
    """Error over time across subjects: pointer minus target, of 100.

    Parameters
    ----------
    time : (T,) array
        Since the profile began, s.
    count : (T,) array
        Subjects with a pointer at that time.
    mean : (T,) array
        NaN without a subject.
    deviation : (T,) array
        Standard deviation; NaN with fewer than 2.
    low, middle, high : (T,) array
        10th, 50th and 90th percentile, accurate to half a bin, 0.25 of 100.
    """

    time: Array
    count: NDArray[np.int64]
    mean: Array
    deviation: Array
    low: Array
    middle: Array
    high: Array


class RunningError:
    """Mean, spread and percentiles over subjects who are added one by one.

    Mean and variance by the method of Welford (1962, Technometrics 4:419); percentiles
    from a histogram at each time.

    Parameters
    ----------
    time : (T,) array
        s.

    Examples
    --------
    >>> running = RunningError([0.0, 0.05])
    >>> for error in ([1.0, -2.0], [3.0, float("nan")]):
    ...     running.add(error)
    >>> found = running.result()
    >>> found.mean.tolist(), found.count.tolist()
    ([2.0, -2.0], [2, 1])
    """

    def __init__(self, time: ArrayLike) -> None:
        self.time = np.asarray(time, dtype=np.float64)
        n = len(self.time)
        self._count = np.zeros(n, dtype=np.int64)
        self._mean = np.zeros(n)
        self._squares = np.zeros(n)
        self._bins = np.zeros((n, _BINS), dtype=np.uint32)

    def add(self, error: ArrayLike) -> None:
        """Add the error of one subject: (T,), NaN where there was no pointer."""
        value = np.asarray(error, dtype=np.float64)
        if value.shape != self.time.shape:
            raise InvalidInput(
                f"expected an error at {len(self.time)} times, found {value.shape}."
            )
        at = np.flatnonzero(np.isfinite(value))
        seen = value[at]
        self._count[at] += 1
        step = seen - self._mean[at]
        self._mean[at] += step / self._count[at]
        self._squares[at] += step * (seen - self._mean[at])
        place = np.clip((seen + _FARTHEST) / _BIN, 0, _BINS - 1).astype(np.int64)
        self._bins[at, place] += 1

    def result(self) -> ErrorOverTime:
        """Return the statistics of the subjects added so far."""
        n = self._count
        with np.errstate(divide="ignore", invalid="ignore"):
            deviation = np.sqrt(self._squares / (n - 1))
        return ErrorOverTime(
            self.time,
            n.copy(),
            np.where(n > 0, self._mean, np.nan),
            np.where(n > 1, deviation, np.nan),
            *(self._quantile(share) for share in (0.1, 0.5, 0.9)),
        )

    def _quantile(self, share: float) -> Array:
        """Quantile from the histogram, interpolated within its bin."""
        below = np.cumsum(self._bins, axis=1, dtype=np.float64)
        wanted = share * self._count
        # The first bin that is not empty and reaches the count.
        k = np.argmax((below >= wanted[:, None]) & (self._bins > 0), axis=1)
        rows = np.arange(len(k))
        inside = self._bins[rows, k].astype(np.float64)
        before = below[rows, k] - inside
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.clip((wanted - before) / inside, 0.0, 1.0)
        value = -_FARTHEST + _BIN * (k + part)
        return np.where(self._count > 0, value, np.nan)
