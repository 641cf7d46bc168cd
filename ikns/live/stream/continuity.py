"""Count frames that a stream lost, delayed, repeated or reordered.

Uses frame numbers and times only, and constant memory. The delay is receive time minus
device time; as the clocks need not agree, lateness is the delay above the smallest one
of the last 30 to 60 s (packet delay variation, RFC 5481, section 4.2).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

from ikns.errors import InvalidInput
from ikns.live.stream.delays import Delays
from ikns.live.stream.frame import Frame

#: Half of the window for the smallest delay, s.
_WINDOW = 30.0
#: Number of gaps that late frames can still fill; older gaps are final.
_GAPS = 256


@dataclass(frozen=True)
class Counts:
    """Counts of frames by what happened to them; a frame can count several times.

    Parameters
    ----------
    received : int
        Frames received, including repeated ones.
    dropped : int
        Frame numbers missing between the first and the last received.
    late : int
        Frames later than `late_after`; by default, after their successor was due.
    repeated : int
        Frames whose number had been received before.
    out_of_order : int
        Frames received after a later one.
    frozen : int
        Frames with a new number but exactly the markers of the frame before.
    restarts : int
        How often the numbering restarted.
    jitter : dict
        Lateness in s: ``p50``, ``p95``, ``p99``, ``p999`` and ``largest``.
    """

    received: int
    dropped: int
    late: int
    repeated: int
    out_of_order: int
    frozen: int
    restarts: int
    jitter: dict[str, float]


class Continuity:
    """Counts frames as they are received.

    Parameters
    ----------
    rate : float
        Frames per second of the device's clock.
    speed : float
        Device seconds per second; 0 when frames have no pace.
    late_after : float, optional
        A frame is late from this lateness on, s; one frame period by default.
    """

    def __init__(
        self, rate: float, *, speed: float = 1.0, late_after: float | None = None
    ) -> None:
        if not (math.isfinite(rate) and rate > 0):
            raise InvalidInput(f"expected a rate above 0 frames/s, found {rate:g}.")
        if not (math.isfinite(speed) and speed >= 0):
            raise InvalidInput(f"expected a speed of 0 or more, found {speed:g}.")
        self._speed = speed
        period = 1 / (rate * speed) if speed else math.inf
        self.late_after = period if late_after is None else late_after
        # A number more than a second back is a restart, not a late frame: a server
        # was started again, or plays its file from the beginning.
        self._horizon = max(100, round(rate))
        self._delays = Delays()
        self._received = self._dropped = self._late = self._repeated = 0
        self._out_of_order = self._frozen = self._restarts = 0
        self._first = self._highest = 0
        self._gaps: list[tuple[int, int]] = []  # [start, stop), ascending
        self._last: Frame | None = None
        self.new_clock()

    def new_clock(self) -> None:
        """Forget the smallest delay, as after a restart of the device."""
        self._smallest = self._smallest_before = math.inf
        self._window_ends = -math.inf

    def skip(self) -> None:
        """Do not count the frames before the next one as dropped."""
        self._last = None

    def add(self, frame: Frame) -> None:
        """Count the next frame."""
        if self._last is None or frame.number < self._highest - self._horizon:
            if self._last is not None:
                self._restarts += 1
                self.new_clock()
            self._first = self._highest = frame.number
            self._gaps = []
        elif not self._place(frame.number):
            self._received += 1
            self._repeated += 1
            return
        elif (
            frame.markers.tobytes() == self._last.markers.tobytes()
            and (frame.markers == frame.markers).any()
        ):
            self._frozen += 1
        self._received += 1
        self._last = frame
        self._time(frame)

    def _place(self, number: int) -> bool:
        """Add a frame number; return False if it was received before."""
        if number > self._highest:
            self._miss(self._highest + 1, number)
            self._highest = number
            return True
        if number < self._first:
            self._out_of_order += 1
            self._dropped += self._first - number - 1
            if number + 1 < self._first:
                self._gaps.insert(0, (number + 1, self._first))
            self._first = number
            return True
        at = bisect_right(self._gaps, number, key=lambda gap: gap[0]) - 1
        if at < 0 or number >= self._gaps[at][1]:
            return False
        start, stop = self._gaps.pop(at)
        parts = [(start, number), (number + 1, stop)]
        self._gaps[at:at] = [(a, b) for a, b in parts if a < b]
        self._dropped -= 1
        self._out_of_order += 1
        return True

    def _miss(self, start: int, stop: int) -> None:
        if start < stop:
            self._dropped += stop - start
            self._gaps.append((start, stop))
            del self._gaps[:-_GAPS]

    def _time(self, frame: Frame) -> None:
        if not (self._speed and math.isfinite(frame.device_time)):
            return
        delay = frame.receive_time - frame.device_time / self._speed
        if frame.receive_time >= self._window_ends:
            self._smallest_before, self._smallest = self._smallest, math.inf
            self._window_ends = frame.receive_time + _WINDOW
        self._smallest = min(self._smallest, delay)
        lateness = delay - min(self._smallest, self._smallest_before)
        self._delays.add(lateness)
        self._late += lateness > self.late_after

    @property
    def counts(self) -> Counts:
        """All counts so far."""
        percentile = self._delays.percentile
        return Counts(
            received=self._received,
            dropped=self._dropped,
            late=self._late,
            repeated=self._repeated,
            out_of_order=self._out_of_order,
            frozen=self._frozen,
            restarts=self._restarts,
            jitter={
                "p50": percentile(50),
                "p95": percentile(95),
                "p99": percentile(99),
                "p999": percentile(99.9),
                "largest": percentile(100),
            },
        )
