"""Frames between the thread that receives them and the one that reads them."""

from __future__ import annotations

import threading
import time
from collections import deque

from ikns.live.stream.frame import Frame

__all__ = ["Inbox"]


class Inbox:
    """A bounded queue that forgets the oldest frame when it is full.

    Parameters
    ----------
    size : int
        Frames it holds.

    Attributes
    ----------
    overruns : int
        Frames forgotten because nobody read them; the reader sees their numbers
        missing.
    """

    def __init__(self, size: int) -> None:
        self._frames: deque[Frame] = deque(maxlen=size)
        self._news = threading.Condition()
        self._closed = False
        self.overruns = 0

    def put(self, frame: Frame) -> None:
        """Add a frame; never waits."""
        with self._news:
            self.overruns += len(self._frames) == self._frames.maxlen
            self._frames.append(frame)
            self._news.notify()

    def get(self, timeout: float) -> Frame | None:
        """Take the oldest frame, None after `timeout` seconds."""
        give_up = time.monotonic() + timeout
        with self._news:
            while not self._frames and not self._closed:
                left = give_up - time.monotonic()
                if left <= 0:
                    return None
                self._news.wait(left)
            return self._frames.popleft() if self._frames else None

    def close(self) -> None:
        """Wake whoever waits."""
        with self._news:
            self._closed = True
            self._news.notify_all()
