"""What time it is: the device's clock while frames come, else this machine's."""

from __future__ import annotations

import time

from ikns.stream import Frame

__all__ = ["DeviceClock"]

#: A device's clock that jumps by more between frames is not followed, s.
JUMP = 2.0


class DeviceClock:
    """The device's clock from the first frame on, this machine's between frames."""

    def __init__(self) -> None:
        self.now = 0.0
        self._frame: Frame | None = None
        self._at_frame = 0.0
        self._heard = time.monotonic()

    @property
    def silence(self) -> float:
        """Since the last frame, s of this machine."""
        return time.monotonic() - self._heard

    def advance(self, frame: Frame | None) -> None:
        """Go on to a frame, or to the present where none came."""
        if frame is None:
            self.now = max(self.now, self._at_frame + self.silence)
            return
        if self._frame is not None:
            step = frame.device_time - self._frame.device_time
            usual = 0 <= step <= max(JUMP, 2 * self.silence)
            passed = step if usual else self.silence
            self.now = max(self.now, self._at_frame + passed)
        self._frame, self._at_frame = frame, self.now
        self._heard = time.monotonic()
