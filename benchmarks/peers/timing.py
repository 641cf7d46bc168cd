"""Solvers that live in this process: one call a frame, only the call timed."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["FrameByFrame"]

Array = NDArray[np.float64]


class FrameByFrame:
    """Solve frames one after the other, each from the answer to the one before.

    Parameters
    ----------
    solve : callable
        From the markers (M, 3) of a frame and the pose before (25,) to the pose.
    markers : (T, M, 3) array
    start : (25,) array
        Pose before the first frame.
    """

    def __init__(
        self, solve: Callable[[Array, Array], Array], markers: Array, start: Array
    ) -> None:
        self.solve, self.markers, self.start = solve, markers, start
        self.begin()

    def begin(self) -> None:
        """Go to the start."""
        self.q = self.start

    def run(self, first: int, last: int) -> tuple[Array, Array]:
        """Solve frames; configurations, and seconds of each."""
        solve, clock, before = self.solve, time.thread_time_ns, self.q
        q, spent = np.empty((last - first, len(before))), np.empty(last - first)
        for i in range(first, last):
            seen = self.markers[i]
            begun = clock()
            before = solve(seen, before)
            spent[i - first] = clock() - begun
            q[i - first] = before
        self.q = before
        return q, 1e-9 * spent
