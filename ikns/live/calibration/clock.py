"""What time it is: the device's clock while frames come, else this machine's."""

from __future__ import annotations

import math
import time

from ikns.live.stream import Frame

__all__ = ["DeviceClock"]

#: A device's clock that jumps by more between frames is not followed, s.
JUMP = 2.0
#: Frames may be so late before time goes on without them, s.
GRACE = 1.0


class DeviceClock:
    """Seconds since the first frame, which never go back.

    Parameters
    ----------
    grace : float
        Frames may be so late before time goes on without them, s.

    Attributes
    ----------
    now : float
    """

    def __init__(self, grace: float = GRACE) -> None:
        self.now = 0.0
        self._grace = grace
        self._device = math.nan  # time of the last frame, by the device and by us
        self._ours = 0.0
        self._heard = time.monotonic()

    @property
    def silence(self) -> float:
        """Since the last frame, s of this machine."""
        return time.monotonic() - self._heard

    def advance(self, frame: Frame | None) -> None:
        """Go on to a frame, or to the present where none came."""
        silence = self.silence
        if frame is None:
            self.now = max(self.now, self._ours + silence - self._grace)
            return
        if not math.isnan(self._device):
            step = frame.device_time - self._device
            # A frame out of order is a little earlier; a new clock is far off.
            usual = -JUMP <= step <= max(JUMP, 2 * silence)
            self._ours += step if usual else silence
        self._device = frame.device_time
        self._heard = time.monotonic()
        self.now = max(self.now, self._ours)
