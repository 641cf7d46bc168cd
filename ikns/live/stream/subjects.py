"""Whose markers a stream carries: one subject at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from ikns.body.marker_set import MarkerSet
from ikns.errors import MarkerMismatch
from ikns.live.stream.frame import Event, Feed, Frame

#: Between the name of a subject and that of a marker: Vicon's and Qualisys's.
_SEPARATORS = ":_"


def subjects_of(labels: Sequence[str], marker_set: MarkerSet) -> list[str]:
    """Return the subjects whose markers are among the labels, as first spelled.

    Parameters
    ----------
    labels : sequence of str
        Such as ``Ann:RSHO`` or ``Ann_RSHO``.
    marker_set : MarkerSet
        The markers that count; those of a table or a wand do not.

    Examples
    --------
    >>> labels = ["Ann:RSHO", "Ann:RELB", "Bob:rwra", "Wand:Tip", "C7"]
    >>> subjects_of(labels, MarkerSet.load("oxford24"))
    ['Ann', 'Bob']
    """
    names = [n.casefold() for m in marker_set.markers for n in (m.label, *m.aliases)]
    found: dict[str, str] = {}
    for label in labels:
        for name in names:
            before = label[: -len(name) - 1]
            ends = label[len(before) :].casefold()
            if before and ends[:1] in _SEPARATORS and ends[1:] == name:
                found.setdefault(before.casefold(), before)
    return list(found.values())


def check_one_subject(source: str, labels: Sequence[str], worn: MarkerSet) -> None:
    """Refuse a stream that has markers of a set from several subjects.

    Raises
    ------
    MarkerMismatch
        With their names.
    """
    found = subjects_of(labels, worn)
    if len(found) > 1:
        raise MarkerMismatch(
            f"{source}: expected the markers of one subject, found those of "
            f"{', '.join(found[:-1])} and {found[-1]}; choose one with the option "
            f"subject, as in ?subject={found[0]}."
        )


class SubjectFeed:
    """The markers of one subject of a feed, without its name.

    Parameters
    ----------
    feed : Feed
    subject : str
        In any case.

    Raises
    ------
    MarkerMismatch
        When there is no marker of that subject.
    """

    def __init__(self, feed: Feed, subject: str) -> None:
        starts = tuple(f"{subject.casefold()}{mark}" for mark in _SEPARATORS)
        columns = [
            column
            for column, label in enumerate(feed.labels)
            if label.casefold().startswith(starts)
        ]
        if not subject or not columns:
            raise MarkerMismatch(
                f"{feed.name}: expected markers of the subject '{subject}', such as "
                f"{subject}:RSHO, found only {', '.join(feed.labels)}."
            )
        self.name, self.rate, self.speed = feed.name, feed.rate, feed.speed
        self.labels = tuple(feed.labels[c][len(subject) + 1 :] for c in columns)
        self.events: deque[Event] = feed.events
        self._feed, self._columns = feed, np.array(columns)

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
        frame = self._feed.poll(timeout)
        if frame is None:
            return None
        markers = frame.markers[self._columns]
        return Frame(frame.number, frame.device_time, frame.receive_time, markers)

    def skip(self) -> None:
        """Forget the frames that came but were not read."""
        self._feed.skip()

    def close(self) -> None:
        """Close the connection."""
        self._feed.close()
