"""Frame numbers for LSL, which has none, from time stamps."""

from __future__ import annotations

import math

#: Stamps farther than this from whole frame periods are uneven, in periods.
_EVEN = 0.25
#: Number of successive even stamps that end an uneven stretch; the probability that
#: uneven stamps do so by chance is 2^-100.
_RUN = 100


class Numbers:
    """Numbers frames by their time stamps.

    While stamps are whole frame periods apart, as those of cameras are, a step of n
    periods is n frames: 2 means that one was lost, 0 repeated, -1 out of order. Stamps
    taken by a program on ordinary timers are too uneven for that. Then frames are only
    counted, and a lost frame cannot be distinguished from a late stamp, unless a second
    or more is missing.

    Parameters
    ----------
    rate : float
        Frames per second.

    Attributes
    ----------
    uneven : bool
        Whether frames are only counted at present.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._number, self._stamp = 0, math.nan
        self._even_in_row = 0
        self._bridge = False
        self.uneven = False

    def bridge(self) -> None:
        """Treat the next frame as the first after a break: only its stamp counts."""
        self._bridge = True

    def next(self, stamp: float) -> int:
        """Return the number of the frame with this stamp, s."""
        if math.isnan(self._stamp):
            self._stamp = stamp
            return self._number
        periods = (stamp - self._stamp) * self._rate
        self._stamp = stamp
        step = round(periods)
        # A gap of a second or more says nothing about evenness.
        if self._bridge:
            self._bridge = False
            step = max(1, step)
        elif abs(periods) < self._rate:
            even = abs(periods - step) <= _EVEN
            self._even_in_row = self._even_in_row + 1 if even else 0
            self.uneven = not even or (self.uneven and self._even_in_row < _RUN)
            if self.uneven:
                step = int(periods != 0)
        self._number += step
        return self._number
