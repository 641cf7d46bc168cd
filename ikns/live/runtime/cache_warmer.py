"""Keep the processor's caches warm between frames.

While a thread sleeps, its code and data leave the processor's caches, and the next
frame takes four times as long (benchmarks/live_loop.py). So shortly before a frame is
due, a second controller processes the last one again; its results are not used.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from ikns.live.control.controller import Controller
from ikns.live.session import micro

#: How long before a frame is due, s; warming up takes a third of this.
_AHEAD = 1.5e-3


class CacheWarmer:
    """Processes the last frame again shortly before the next one is due.

    Parameters
    ----------
    controller : Controller
        One of its own, set up as the one that drives the finger.
    period : float
        Between frames, s; infinite where frames have no pace.

    Attributes
    ----------
    count : int
        How often it has warmed the caches.
    """

    def __init__(self, controller: Controller, period: float) -> None:
        self._controller, self._period = controller, period
        # Faster sources leave no time for it, and keep the caches warm themselves.
        self._enabled = 4 * _AHEAD <= period < math.inf
        self._last: tuple[float, NDArray[np.float64], float] | None = None
        self.count = 0

    def frame(
        self, markers: NDArray[np.float64], device_time: float, received: float
    ) -> None:
        """Remember a frame and expect the next one a period after it."""
        if self._enabled:
            self._last = (received + self._period, markers, device_time)

    def time_left(self) -> float:
        """Seconds until :meth:`warm_caches` has something to do; may be infinite."""
        if self._last is None:
            return math.inf
        return self._last[0] - _AHEAD - time.monotonic()

    def warm_caches(self) -> bool:
        """Process the last frame again if it is time to; return whether it was."""
        if self._last is None:
            return False
        due, markers, device_time = self._last
        now = time.monotonic()
        if now < due - _AHEAD:
            return False
        self._last = None
        if now > due - _AHEAD / 2:  # too late: it would delay the next frame
            return False
        self._controller.frame(micro(markers), device_time, now)
        self.count += 1
        return True
