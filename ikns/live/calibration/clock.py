"""A clock that follows the device while frames come, and this machine otherwise."""

from __future__ import annotations

import math
import time

from ikns.live.stream import Frame

#: Larger jumps of the device's clock between frames are not followed, s.
JUMP = 2.0
#: Time continues without frames after this delay, s.
GRACE = 1.0


class DeviceClock:
    """Seconds since the first frame; they never run back.

    Parameters
    ----------
    grace : float
        Time continues without frames after this delay, s.

    Attributes
    ----------
    now : float
        Present time, s.
    """

    def __init__(self, grace: float = GRACE) -> None:
        self.now = 0.0
        self._grace = grace
        self._device = math.nan  # device time of the last frame
        self._frame_time = 0.0
        self._received = time.monotonic()

    @property
    def silence(self) -> float:
        """Time since the last frame on this machine's clock, s."""
        return time.monotonic() - self._received

    def advance(self, frame: Frame | None) -> None:
        """Advance to a frame, or to the present if none came."""
        silence = self.silence
        if frame is None:
            self.now = max(self.now, self._frame_time + silence - self._grace)
            return
        if not math.isnan(self._device):
            step = frame.device_time - self._device
            # A frame out of order is slightly earlier; a restarted clock is far off.
            usual = -JUMP <= step <= max(JUMP, 2 * silence)
            self._frame_time += step if usual else silence
        self._device = frame.device_time
        self._received = time.monotonic()
        self.now = max(self.now, self._frame_time)
