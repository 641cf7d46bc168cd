"""Frames sorted by number into a recording of constant rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.live.stream import Frame
from ikns.recording.recording import Recording


def recording_from_frames(
    frames: Sequence[Frame], labels: Sequence[str], rate: float, source: str
) -> Recording | None:
    """Make a recording of frames.

    Frame numbers give the time: a lost frame becomes a row of NaN, a late one is put in
    order, and a repeated one is used once. A number more than 1 s back or 10 s ahead
    means that the device restarted counting; its frames are appended.

    Parameters
    ----------
    frames : sequence of Frame
        In the order of receipt.
    labels : sequence of M str
    rate : float
        Frames per second of the device's clock.
    source : str
        Name of the recording.

    Returns
    -------
    Recording or None
        Starting at 0 s; None with fewer than two frames.
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
