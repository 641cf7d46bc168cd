"""Frame numbers for LSL, which has none, from its time stamps."""

from __future__ import annotations

import math

__all__ = ["Numbers"]

#: Stamps further than this from whole frame periods are uneven, in periods.
_EVEN = 0.25
#: Even stamps in a row that end a time of uneven ones; chance makes 2^-100 of it.
_RUN = 100


class Numbers:
    """Number frames by their stamps.

    While stamps lie on whole frame periods, as those of cameras do, a step of n periods
    is n frames: 2 means one was lost, 0 repeated, -1 out of order. Stamps that a
    program takes when it gets round to it are too uneven for that. Then frames are only
    counted; one lost cannot be told from one stamped late, unless a second is missing.

    Parameters
    ----------
    rate : float
        Frames per second.

    Attributes
    ----------
    uneven : bool
        Whether frames are only counted, for now.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._number, self._stamp = 0, math.nan
        self._even_in_row = 0
        self._bridge = False
        self.uneven = False

    def bridge(self) -> None:
        """Take the next frame for a new one, numbered by its stamp alone."""
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
