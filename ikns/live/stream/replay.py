"""A recording as a live source."""

from __future__ import annotations

import math
import time
from collections import deque

from ikns.errors import InvalidInput
from ikns.live.stream.frame import Event, Frame
from ikns.recording.recording import Recording


def wait_until(due: float) -> float:
    """Sleep until a time of `time.monotonic`; return the time after it."""
    while (now := time.monotonic()) < due:
        time.sleep(due - now)
    return now


def frame_times(recording: Recording) -> tuple[float, float]:
    """Return the recording's rate (frames/s) and the length of one loop (s).

    A loop lasts one frame period longer than the recording, so that the first frame
    follows the last one at the usual interval.

    Raises
    ------
    InvalidInput
        When there are fewer than two frames, hence no rate.
    """
    rate = recording.rate
    if not (math.isfinite(rate) and rate > 0):
        raise InvalidInput(
            f"{recording.source}: expected at least two frames to determine a rate, "
            f"found {len(recording.time)}."
        )
    return rate, float(recording.time[-1] - recording.time[0]) + 1 / rate


class Replay:
    """Return a recording's frames when they are due.

    Deadlines are absolute, counted from the first read: a late frame delays no other,
    and nothing drifts. No frame is left out, so a slow reader gets old frames, which
    their receive times show.

    Parameters
    ----------
    recording : Recording
    speed : float
        Device seconds per second; 0 for as fast as frames are read.
    loop : bool
        Start over at the end; frame numbers and device times continue.

    Attributes
    ----------
    recording : Recording

    Raises
    ------
    InvalidInput
        When the speed is negative or the recording has no rate.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        speed: float = 1.0,
        loop: bool = False,
        name: str | None = None,
    ) -> None:
        if not (math.isfinite(speed) and speed >= 0):
            raise InvalidInput(f"expected a speed of 0 or more, found {speed:g}.")
        self.rate, self._loop_seconds = frame_times(recording)
        self.name = name or f"replay:{recording.source}"
        self.labels = recording.labels
        self.speed = speed
        self.events: deque[Event] = deque(maxlen=1000)
        self.recording = recording
        self._loop = loop
        self._number = 0
        self._start = math.nan

    @property
    def device(self) -> dict[str, float]:
        """Nothing: a recording has no device."""
        return {}

    @property
    def ended(self) -> bool:
        """Whether all frames have been read."""
        return not self._loop and self._number >= len(self.recording.time)

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame when it is due, None after `timeout` seconds."""
        if self.ended:
            return None
        loops, row = divmod(self._number, len(self.recording.time))
        device_time = float(self.recording.time[row]) + loops * self._loop_seconds
        now = time.monotonic()
        if math.isnan(self._start):
            self._start = now
        if self.speed:
            first = float(self.recording.time[0])
            due = self._start + (device_time - first) / self.speed
            if due > now + timeout:
                wait_until(now + timeout)
                return None
            now = wait_until(due)
        frame = Frame(self._number, device_time, now, self.recording.markers[row])
        self._number += 1
        return frame

    def skip(self) -> None:
        """Nothing comes before it is read."""

    def close(self) -> None:
        """Nothing is held open."""
