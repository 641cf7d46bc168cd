"""A reference without a human model: it copies the target after a known delay."""

import math
from collections import deque

from ikns.errors import InvalidInput


class DelayedCopy:
    """An operator without feedback, to check metrics against known answers.

    Through an ideal device a delay of 0 gives no error, and any other delay is the lag
    that metrics must find; with a gain of 0 the limb does not move.

    Parameters
    ----------
    delay : float
        s, rounded to whole samples.
    rate : float
        Samples per second.
    gain : float
        Of the target's distance from `start`.
    start : float
        Position of the limb until the delay has passed.

    >>> copy = DelayedCopy(0.02, rate=100)
    >>> [copy.step(x, 0.0) for x in (0.1, 0.2, 0.3, 0.4)]
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
        self.limb = start
        samples = round(delay * rate)
        self._past: deque[float] = deque([math.nan] * samples, maxlen=samples + 1)

    @property
    def preview(self) -> float:
        """One sample: what is copied now shows in the next one."""
        return 1 / self.rate

    def step(self, ahead: float, seen: float) -> float:
        """Advance by one sample; what is seen has no effect."""
        self._past.append(ahead)
        copied = self._past[0]
        if not math.isnan(copied):
            self.limb = (1 - self.gain) * self.start + self.gain * copied
        return self.limb
