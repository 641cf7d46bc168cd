"""A stream of markers under other labels."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from ikns.live.stream.frame import Event, Feed, Frame
from ikns.recording.labels import new_labels


class RenamedFeed:
    """The frames of a feed, with other labels.

    Parameters
    ----------
    feed : Feed
    names : mapping
        New label by old one, as for :func:`ikns.recording.labels.renamed`.

    Raises
    ------
    InvalidInput
        When two markers would have one name.
    """

    def __init__(self, feed: Feed, names: Mapping[str, str]) -> None:
        self.name, self.rate, self.speed = feed.name, feed.rate, feed.speed
        self.labels = tuple(new_labels(feed.labels, names, source=feed.name))
        self.events: deque[Event] = feed.events
        self._feed = feed

    @property
    def device(self) -> dict[str, float]:
        """Values that the device reports."""
        return self._feed.device

    @property
    def ended(self) -> bool:
        """Whether no more frames will come."""
        return self._feed.ended

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, or None when none comes within `timeout` seconds."""
        return self._feed.poll(timeout)

    def skip(self) -> None:
        """Forget the frames that came but were not read."""
        self._feed.skip()

    def close(self) -> None:
        """Close the connection."""
        self._feed.close()
