"""What hears of each frame and event of a live loop while it runs."""

from __future__ import annotations

from typing import Protocol

from ikns.arrays import Array
from ikns.live.control.controller import Decision


class LoopListener(Protocol):
    """Called from within the loop, so no method may wait.

    Times are in s of `time.monotonic`.
    """

    def decision(self, received: float, decision: Decision, markers: Array) -> None:
        """Take the result of a frame, received at a time, once it was commanded.

        The markers are those that were used, (M, 3) m in the world; no one changes them
        any more.
        """

    def event(self, at: float, name: str, text: str) -> None:
        """Take an event, as the session has it."""
