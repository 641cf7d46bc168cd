"""Frames as they came, put where their numbers belong: a recording at a steady rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.live.stream import Frame
from ikns.recording.recording import Recording

__all__ = ["recording_from_frames"]


def recording_from_frames(
    frames: Sequence[Frame], labels: Sequence[str], rate: float, source: str
) -> Recording | None:
    """Return the recording that frames make up.

    Frame numbers are the time: a frame that never came is a row of NaN, a late one goes
    to its place, one that came twice counts once. A number more than 1 s back or 10 s
    ahead is a device that counts anew: its frames follow on.

    Parameters
    ----------
    frames : sequence of Frame
        In the order in which they came.
    labels : sequence of M str
    rate : float
        Frames per second of the device's clock.
    source : str
        Name of the recording.

    Returns
    -------
    Recording or None
        From 0 s on; None when there are fewer than two frames.
    """
    rows: dict[int, Frame] = {}
    row, before = -1, None
    for frame in frames:
        step = 1 if before is None else frame.number - before
        row += step if -rate <= step <= 10 * rate else 1
        before = frame.number
        rows.setdefault(row, frame)
    if len(rows) < 2:
        return None
    first, last = min(rows), max(rows)
    markers = np.full((last - first + 1, len(labels), 3), np.nan)
    for row, frame in rows.items():
        markers[row - first] = frame.markers
    return Recording(np.arange(len(markers)) / rate, markers, labels, source)
