"""A live source: frames one by one, with counts of faults and events."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator

from ikns.errors import StreamError
from ikns.live.stream.continuity import Continuity
from ikns.live.stream.frame import Event, Feed, Frame
from ikns.recording.files.conversion import mark_gaps


class Source:
    """Frames from a feed; a context manager and an iterator.

    A point at exactly zero was not seen and becomes NaN, as in files.

    Parameters
    ----------
    feed : Feed
        Provides the frames.
    read_timeout : float
        Iterating raises an error after this time without a frame, s.
    late_after : float, optional
        See :class:`Continuity`.
    """

    def __init__(
        self,
        feed: Feed,
        *,
        read_timeout: float = 10.0,
        late_after: float | None = None,
    ) -> None:
        self._feed = feed
        self._read_timeout = read_timeout
        self.continuity = Continuity(feed.rate, speed=feed.speed, late_after=late_after)
        period = 1 / (feed.rate * feed.speed) if feed.speed else 0.0
        self._silence = max(1.0, 10 * period)
        self._last = time.monotonic()
        self._silent = self._closed = False

    @property
    def name(self) -> str:
        """Address of the source."""
        return self._feed.name

    @property
    def labels(self) -> tuple[str, ...]:
        """Marker names, in the order of the frames' first axis."""
        return self._feed.labels

    @property
    def rate(self) -> float:
        """Frames per second of the device's clock."""
        return self._feed.rate

    @property
    def speed(self) -> float:
        """Device seconds per second; 0 when frames come as fast as they are read."""
        return self._feed.speed

    @property
    def events(self) -> deque[Event]:
        """Breaks, pauses and reconnections, the newest last; at most 1000."""
        return self._feed.events

    @property
    def device(self) -> dict[str, float]:
        """Values that the device reports, such as frames lost by the cameras."""
        return self._feed.device

    @property
    def ended(self) -> bool:
        """Whether no more frames will come."""
        return self._closed or self._feed.ended

    def read(self, timeout: float = 1.0) -> Frame | None:
        """Wait for the next frame.

        Returns
        -------
        Frame or None
            None if no frame arrived within `timeout` seconds, or the source has ended.
        """
        frame = None if self.ended else self._feed.poll(timeout)
        now = time.monotonic()
        if frame is not None:
            markers = frame.markers.copy()
            mark_gaps(markers)
            frame = Frame(frame.number, frame.device_time, frame.receive_time, markers)
            if self._silent:
                self._add_event(f"frames resumed after {now - self._last:.1f} s.")
                self._silent = False
            self._last = now
            self.continuity.add(frame)
        elif not self._silent and not self.ended and now - self._last > self._silence:
            self._silent = True
            self._add_event(f"no frame for {now - self._last:.1f} s.")
        return frame

    def skip(self) -> None:
        """Go on with the next frame that comes; those that waited do not count."""
        self._feed.skip()
        self.continuity.skip()
        self._last = time.monotonic()

    def _add_event(self, text: str) -> None:
        self.events.append(Event(time.monotonic(), f"{self.name}: {text}"))

    def __iter__(self) -> Iterator[Frame]:
        """Return itself."""
        return self

    def __next__(self) -> Frame:
        """Return the next frame.

        Raises
        ------
        StreamError
            When no frame comes within the read timeout.
        """
        give_up = time.monotonic() + self._read_timeout
        while not self.ended:
            frame = self.read(max(0.0, min(0.5, give_up - time.monotonic())))
            if frame is not None:
                return frame
            if time.monotonic() >= give_up:
                raise StreamError(
                    f"{self.name}: no frame for {self._read_timeout:g} s."
                )
        raise StopIteration

    def close(self) -> None:
        """Close the source; harmless when repeated."""
        if not self._closed:
            self._closed = True
            self._feed.close()

    def __enter__(self) -> Source:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()
