"""A yardstick, not a person: it copies the target after a known delay."""

from __future__ import annotations

import math
from collections import deque

from ikns.errors import InvalidInput

__all__ = ["Copyist"]


class Copyist:
    """An operator that does not look at the pointer.

    Through a perfect device a delay of 0 gives no error at all, and any other delay is
    the lag to be measured; a gain of 0 is an operator that keeps still.

    Parameters
    ----------
    delay : float
        s, rounded to whole samples.
    rate : float
        Samples per second.
    gain : float
        Of the target's distance from `start`.
    start : float
        Where the limb is at first, and before the delay has passed.

    Examples
    --------
    >>> copyist = Copyist(0.02, rate=100)
    >>> [copyist.step(x, 0.0) for x in (0.1, 0.2, 0.3, 0.4)]
    [0.5, 0.5, 0.1, 0.2]
    """

    def __init__(
        self, delay: float, *, rate: float, gain: float = 1.0, start: float = 0.5
    ) -> None:
        if not 0 <= delay < math.inf or not 0 < rate < math.inf:
            raise InvalidInput(
                "expected a delay from 0 s and a positive rate, found "
                f"{delay:g} s and {rate:g}."
            )
        self.rate, self.gain, self.start = rate, gain, start
        self.place = start
        later = round(delay * rate)
        self._past: deque[float] = deque([math.nan] * later, maxlen=later + 1)

    @property
    def preview(self) -> float:
        """One sample: what is copied now is shown with the next."""
        return 1 / self.rate

    def step(self, ahead: float, seen: float) -> float:
        """Go on by a sample; what is seen does not matter."""
        self._past.append(ahead)
        copied = self._past[0]
        if not math.isnan(copied):
            self.place = (1 - self.gain) * self.start + self.gain * copied
        return self.place
