"""Frames as fast as they are computed: how many a second, and what memory does."""

from __future__ import annotations

import os
import tempfile
from collections import deque
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from ikns.finger import SimulatedFinger
from ikns.live.runtime import run
from ikns.live.stream import Event, Frame, Source
from ikns.live.stream.replay import Replay
from live import person
from live.chain import session_for

__all__ = ["FullSpeed", "full_speed"]


@dataclass
class FullSpeed:
    """How it went.

    Parameters
    ----------
    frames : int
    rate : float
        Frames per second.
    resident : dict of str to float
        MB of this process after a share of the frames.
    lost_rows : int
        Of the session.
    """

    frames: int
    rate: float
    resident: dict[str, float]
    lost_rows: int


class _Counted:
    """A feed that ends after some frames, and looks at the memory on the way."""

    def __init__(self, replay: Replay, frames: int) -> None:
        self._replay, self._frames = replay, frames
        self._count = 0
        self._marks = {round(frames * k / 10): f"{10 * k} %" for k in (1, 5, 10)}
        self.resident: dict[str, float] = {}
        self.name, self.labels = replay.name, replay.labels
        self.rate, self.speed = replay.rate, replay.speed
        self.events: deque[Event] = replay.events
        self.device: dict[str, float] = {}

    @property
    def ended(self) -> bool:
        return self._count >= self._frames

    def poll(self, timeout: float) -> Frame | None:
        self._count += 1
        if self._count in self._marks:
            self.resident[self._marks[self._count]] = resident()
        return self._replay.poll(timeout)

    def skip(self) -> None:
        """Nothing comes before it is read."""

    def close(self) -> None:
        """Nothing is held open."""


def full_speed(folder: Path, frames: int, session: bool) -> FullSpeed:
    """Markers to simulated finger, without a pause."""
    subject, recording = person.load(folder)
    feed = _Counted(Replay(recording, speed=0, loop=True), frames)
    with ExitStack() as stack:
        writer = None
        if session:
            place = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "session"
            writer = stack.enter_context(
                session_for(place, subject, folder / "person", recording)
            )
        with Source(feed) as source:
            report = run(source, subject, SimulatedFinger(), session=writer)
    return FullSpeed(
        report.frames, report.frames / report.seconds, feed.resident, report.lost_rows
    )


def resident() -> float:
    """Memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
