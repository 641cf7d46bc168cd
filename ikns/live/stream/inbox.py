"""Queue between the thread that receives frames and the one that reads them."""

from __future__ import annotations

import threading
import time
from collections import deque

from ikns.live.stream.frame import Frame


class Inbox:
    """A bounded queue that drops the oldest frame when it is full.

    Parameters
    ----------
    size : int
        Largest number of frames.

    Attributes
    ----------
    overruns : int
        Frames dropped because they were not read; the reader finds their numbers
        missing.
    """

    def __init__(self, size: int) -> None:
        self._frames: deque[Frame] = deque(maxlen=size)
        self._changed = threading.Condition()
        self._closed = False
        self.overruns = 0

    def put(self, frame: Frame) -> None:
        """Add a frame without waiting."""
        with self._changed:
            self.overruns += len(self._frames) == self._frames.maxlen
            self._frames.append(frame)
            self._changed.notify()

    def get(self, timeout: float) -> Frame | None:
        """Take the oldest frame, None after `timeout` seconds."""
        give_up = time.monotonic() + timeout
        with self._changed:
            while not self._frames and not self._closed:
                left = give_up - time.monotonic()
                if left <= 0:
                    return None
                self._changed.wait(left)
            return self._frames.popleft() if self._frames else None

    def clear(self) -> None:
        """Forget the frames that are waiting."""
        with self._changed:
            self._frames.clear()

    def close(self) -> None:
        """Wake a waiting reader; frames in the queue can still be read."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
