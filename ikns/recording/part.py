"""A part of a recording: one subject of several, or some seconds of it."""

from __future__ import annotations

import numpy as np

from ikns.errors import InvalidInput, MarkerMismatch, NotEnoughData
from ikns.recording.recording import Recording

#: Between the name of a subject and that of a marker: Vicon's and Qualisys's.
_SEPARATORS = (":", "_")


def one_subject(recording: Recording, prefix: str) -> Recording:
    """Return the markers of one subject, without the subject's name.

    Parameters
    ----------
    recording : Recording
    prefix : str
        What stands before its labels, ``Ann`` of ``Ann:RSHO`` or ``Ann_RSHO``, in any
        case.

    Raises
    ------
    MarkerMismatch
        When there is no marker of that subject; the sentence names those that are.

    Examples
    --------
    >>> two = Recording([0.0], np.ones((1, 2, 3)), ["Ann:RSHO", "Bob:RSHO"])
    >>> one_subject(two, "ann").labels
    ('RSHO',)
    """
    bare = prefix[:-1] if prefix.endswith(_SEPARATORS) else prefix
    starts = tuple(f"{bare}{mark}".casefold() for mark in _SEPARATORS)
    columns = [
        column
        for column, label in enumerate(recording.labels)
        if label.casefold().startswith(starts) and len(label) > len(bare) + 1
    ]
    if not bare or not columns:
        known = dict.fromkeys(
            label.rpartition(":")[0] for label in recording.labels if ":" in label
        )
        found = ", ".join(known) or ", ".join(recording.labels[:4])
        raise MarkerMismatch(
            f"{recording.source}: expected markers of {prefix!r}, found "
            f"{'those of ' if known else ''}{found}."
        )
    return Recording(
        recording.time,
        recording.markers[:, columns],
        [recording.labels[column][len(bare) + 1 :] for column in columns],
        recording.source,
        recording.notes,
    )


def between(
    recording: Recording, start: float | None = None, end: float | None = None
) -> Recording:
    """Return the frames from one moment to another, both among them.

    Parameters
    ----------
    recording : Recording
    start, end : float, optional
        Moments in the recording's own time, s, which the part keeps.

    Raises
    ------
    InvalidInput
        When no frame lies between them, or the first comes after the other.

    Examples
    --------
    >>> whole = Recording(np.arange(100) / 100, np.ones((100, 1, 3)), ["RSHO"])
    >>> between(whole, 0.2, 0.3).markers.shape
    (11, 1, 3)
    """
    time = recording.time
    low = -np.inf if start is None else start
    high = np.inf if end is None else end
    check_order(recording.source, low, high)
    # A moment that was typed in lies a rounding off the frame that it means.
    rounding = 1e-6
    kept = (time >= low - rounding) & (time <= high + rounding)
    if not kept.any():
        if low > time[-1]:
            wrong = f"--from {low:g} s is past its end"
        elif high < time[0]:
            wrong = f"--to {high:g} s is before its start"
        else:
            wrong = f"it has no frame from {low:g} to {high:g} s"
        raise InvalidInput(
            f"{recording.source}: {wrong}; it runs from {time[0]:g} to {time[-1]:g} s."
        )
    return Recording(
        time[kept],
        recording.markers[kept],
        recording.labels,
        recording.source,
        recording.notes,
    )


def check_order(source: object, start: float, end: float) -> None:
    """Refuse a part that ends before it starts; infinite moments are not given."""
    if start > end:
        raise InvalidInput(
            f"{source}: --from {start:g} s is after --to {end:g} s; give an earlier "
            "start."
        )


def require_rate(recording: Recording, *, part: bool) -> None:
    """Refuse a recording, or the `part` of one, that is too short for a frame rate."""
    if (frames := len(recording.time)) < 2:
        what = "part" if part else "recording"
        raise NotEnoughData(
            f"{recording.source}: the {what} has {frames} frame; at least 2 are needed."
        )
