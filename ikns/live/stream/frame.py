"""One frame of markers on its way in, and what every source of them has."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Event", "Feed", "Frame"]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Markers at one instant.

    Parameters
    ----------
    number : int
        Frame number of the device; a gap means frames that never came.
    device_time : float
        Seconds on the device's own clock.
    receive_time : float
        When this process got hold of it, seconds of `time.monotonic`.
    markers : (M, 3) array
        Meters in the world frame; NaN where a marker was not seen.
    """

    number: int
    device_time: float
    receive_time: float
    markers: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth telling about a source.

    Parameters
    ----------
    time : float
        Seconds of `time.monotonic`.
    text : str
        One sentence.
    """

    time: float
    text: str


class Feed(Protocol):
    """What a kind of source must offer; :class:`Source` does the rest.

    ``rate`` is the frames per second of the device's clock and ``speed`` how fast that
    clock runs against this machine's (0: as fast as frames are asked for).
    """

    name: str
    labels: tuple[str, ...]
    rate: float
    speed: float
    events: deque[Event]

    @property
    def device(self) -> dict[str, float]:
        """What the device reports of itself."""
        ...

    @property
    def ended(self) -> bool:
        """Whether no further frame will ever come."""
        ...

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, or None when none comes within `timeout` seconds."""
        ...

    def close(self) -> None:
        """Let go of everything; calling it again does nothing."""
        ...
