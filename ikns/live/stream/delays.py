"""Percentiles of delays in constant memory."""

from __future__ import annotations

import math

import numpy as np

# 40 bins per decade: an edge is 10^(1/40) = 1.059 times the one before.
_PER_DECADE, _LOWEST, _HIGHEST = 40, -6, 3


class Delays:
    """Counts delays in logarithmic bins.

    A percentile is the upper edge of its bin: never below the true value, and at most
    6 % above it. Delays below 1 us count as 1 us. The largest delay is exact.
    """

    def __init__(self) -> None:
        self._counts = [0] * ((_HIGHEST - _LOWEST) * _PER_DECADE + 1)
        self.count = 0
        self.largest = 0.0

    def add(self, seconds: float) -> None:
        """Count one delay."""
        self.count += 1
        if seconds > self.largest:
            self.largest = seconds
        if seconds <= 1e-6:
            self._counts[0] += 1
            return
        index = math.ceil((math.log10(seconds) - _LOWEST) * _PER_DECADE)
        self._counts[min(index, len(self._counts) - 1)] += 1

    def percentile(self, percent: float) -> float:
        """Return the delay that `percent` of all do not exceed, s; NaN without any.

        >>> delays = Delays()
        >>> for milliseconds in range(1, 101):
        ...     delays.add(1e-3 * milliseconds)
        >>> 0.050 <= delays.percentile(50) <= 0.053
        True
        >>> delays.percentile(100)
        0.1
        """
        if not self.count:
            return math.nan
        rank = max(1, math.ceil(percent / 100 * self.count))
        index = int(np.searchsorted(np.cumsum(self._counts), rank))
        return min(10 ** (_LOWEST + index / _PER_DECADE), self.largest)
