"""A frame of markers, and the interface of every kind of source."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Markers at one instant.

    Parameters
    ----------
    number : int
        Frame number of the device; a gap means lost frames.
    device_time : float
        Seconds on the device's own clock.
    receive_time : float
        When this process received it, s of `time.monotonic`.
    markers : (M, 3) array
        Meters in the world frame; NaN where a marker was not seen.
    """

    number: int
    device_time: float
    receive_time: float
    markers: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a source.

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
    """Interface of a kind of source; :class:`Source` adds the rest.

    ``rate`` is in frames per second of the device's clock; ``speed`` is in device
    seconds per second of this machine (0: as fast as frames are read).
    """

    name: str
    labels: tuple[str, ...]
    rate: float
    speed: float
    events: deque[Event]

    @property
    def device(self) -> dict[str, float]:
        """Values that the device reports."""
        ...

    @property
    def ended(self) -> bool:
        """Whether no more frames will come."""
        ...

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, or None when none comes within `timeout` seconds."""
        ...

    def skip(self) -> None:
        """Forget the frames that came but were not read."""
        ...

    def close(self) -> None:
        """Close the connection; harmless when repeated."""
        ...
