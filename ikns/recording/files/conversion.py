"""Checks and conversions that all readers of marker files share.

Millimeters become meters; empty cells and zeros become NaN. The error messages are the
same for every format.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ikns.arrays import Array, Mask
from ikns.errors import FileError, InvalidInput, unreadable
from ikns.recording.recording import Recording

#: Meters in one unit, by the spellings that cameras' software writes.
METERS = {
    short: meters
    for unit, name, meters in (
        ("mm", "millimet", 1e-3),
        ("cm", "centimet", 1e-2),
        ("m", "met", 1.0),
    )
    for short in (unit, f"{name}er", f"{name}ers", f"{name}re", f"{name}res")
}

#: Letters of a unit's name that are enough: some writers cut it off after four.
_UNIT_LETTERS = 4

#: Nexus writes ``*12``, Qualisys ``uname*12`` and Motive ``Unlabeled 12`` for a
#: trajectory without a name.
_UNLABELED = re.compile(
    r"(?:.*:)?(?:(?:uname)?\*\d+|unlabell?ed[ _]*\d*)", re.IGNORECASE
)

#: Frames per second that a marker system can have.
_RATES = (0.1, 1e5)

#: Plausible extent of the markers, m: from one hand (2 cm) to a hall (100 m). Data in
#: meters labeled as mm are below this range up to a volume of 20 m, and data in mm
#: labeled as meters exceed it from an extent of 10 cm on.
_EXTENT = (0.02, 100.0)

#: Most frames, evenly spaced over the recording, from which the extent is computed.
_EXTENT_FRAMES = 500


def existing_file(path: Path) -> int:
    """Return the size in bytes of a regular, readable, non-empty file."""
    if "\0" in str(path):
        raise FileError(f"{shown(str(path))}: this is not a file name.")
    refuse_folder(path)
    if not path.is_file():
        raise FileError(f"{path}: no such file.")
    try:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
    except OSError as error:
        raise unreadable(path, error) from None
    if size == 0:
        raise FileError(f"{path}: this file is empty.")
    return size


def refuse_folder(path: Path) -> None:
    """Refuse the folder of recordings where one of them is meant."""
    if path.is_dir():
        raise FileError(f"{path}: this is a folder; give one recording.")


def shown(text: str) -> str:
    """Return text from a file, short and printable, for a message."""
    text = "".join(c if c.isprintable() else "?" for c in text.strip())
    return f"'{text[:37]}...'" if len(text) > 40 else f"'{text}'"


def meters_per(path: Path, unit: str) -> float:
    """Return how many meters one unit is.

    >>> meters_per(Path("walk.trc"), "MM"), meters_per(Path("walk.c3d"), "mete")
    (0.001, 1.0)
    """
    name = unit.strip(" \t()[]").lower()
    meant = {METERS[name]} if name in METERS else set()
    if not meant and len(name) >= _UNIT_LETTERS:
        meant = {value for known, value in METERS.items() if known.startswith(name)}
    if len(meant) != 1:
        raise FileError(
            f"{path}: expected positions in mm, cm or m, found unit {shown(unit)}."
        )
    return meant.pop()


def checked_rate(path: Path, rate: float) -> float:
    """Return the frame rate in Hz, or refuse one that no camera has."""
    if not _RATES[0] <= rate <= _RATES[1]:
        raise FileError(
            f"{path}: expected a frame rate between {_RATES[0]:g} and {_RATES[1]:g} "
            f"frames per second, found {rate:g}."
        )
    return float(rate)


def frame_times(
    frame: Array, printed: Array, rate: float, notes: list[str], *, zero: int = 1
) -> Array:
    """Return the time of each frame, s; note where header and times disagree.

    Exact times where the printed ones, of few digits, agree to half a frame.

    Parameters
    ----------
    frame, printed : (T,) array
        Frame numbers and times as in the file; times may be NaN.
    rate : float
        Of the header, frames per s.
    notes : list of str
        Gets the note.
    zero : int
        Number of the frame at 0 s, where no times are printed.
    """
    steps = (frame - frame[0]) / rate
    if np.isnan(printed).all():
        return np.asarray((frame[0] - zero) / rate + steps)
    exact = printed[0] + steps
    if np.abs(printed - exact).max() < 0.5 / rate:
        return np.asarray(exact)
    with np.errstate(divide="ignore", invalid="ignore"):  # numbers that repeat
        spacing = float(np.median(np.diff(printed) / np.diff(frame)))
    if abs(spacing * rate - 1) > 0.01:
        notes.append(
            f"its header says {rate:.4g} frames per second, its times "
            f"{1 / spacing if spacing else math.inf:.4g}; the times count."
        )
    return printed


def is_unlabeled(label: str) -> bool:
    """Whether the software gave this trajectory a number instead of a name.

    >>> is_unlabeled("*115"), is_unlabeled("ADL001:RSHO1")
    (True, False)
    """
    return not label or _UNLABELED.fullmatch(label) is not None


def mark_gaps(markers: Array) -> Mask:
    """Make every point that was not seen NaN, in place, and return where that is.

    That is a point with a missing coordinate, and one at exactly zero: many systems
    write "not seen" so, and no camera measures three zeros.

    Parameters
    ----------
    markers : (..., 3) array

    Examples
    --------
    >>> markers = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, np.nan, 1.0]])
    >>> mark_gaps(markers).tolist(), np.isnan(markers[:, 0]).tolist()
    ([True, False, True], [True, False, True])
    """
    # The largest is NaN where one is, and 0 where all are.
    gap = ~(np.abs(markers).max(axis=-1) > 0)
    markers[gap] = np.nan
    return gap


def to_recording(
    path: Path,
    time: Array,
    markers: Array,
    labels: Sequence[str],
    *,
    unit: str,
    notes: Sequence[str] = (),
) -> Recording:
    """Return markers (T, M, 3) in meters as a recording, gaps as NaN; changed in place.

    A point with a missing coordinate becomes NaN, and so does one at exactly zero, as
    many systems write "not seen". Labels that stand several times are numbered. The
    file's unit is named where the extent is not that of a person in a room.
    """
    if not len(labels):
        raise FileError(f"{path}: expected at least one named marker, found none.")
    if not len(time):
        raise FileError(f"{path}: expected at least one frame, found none.")
    unreadable = [label for label in labels if not label.isprintable()]
    if unreadable:
        raise FileError(
            f"{path}: expected printable marker labels, found {shown(unreadable[0])}, "
            f"so the file is damaged."
        )
    if mark_gaps(markers).all():
        raise FileError(
            f"{path}: expected positions, but none of its {len(labels)} markers "
            f"is seen in any of its {len(time)} frames."
        )
    labels, columns, doubled = _distinct(labels, markers)
    if doubled:
        markers = markers[:, columns]
    try:
        recording = Recording(
            time, markers, labels, str(path), notes=(*notes, *doubled)
        )
    except InvalidInput as error:
        raise FileError(str(error)) from None
    _check_extent(path, recording, unit)
    return recording


def _distinct(
    labels: Sequence[str], markers: Array
) -> tuple[list[str], list[int], list[str]]:
    """Make every label stand once: labels, the columns that they name, and notes.

    Markers of one name that differ are numbered, ``RKNE #1`` and ``RKNE #2``: chance
    must not decide which of them is meant. A marker set that needs the name refuses
    them, see :meth:`ikns.body.marker_set.MarkerSet.columns`.
    """
    places: dict[str, list[int]] = {}
    for column, label in enumerate(labels):
        places.setdefault(label, []).append(column)
    names: dict[int, str] = {}
    notes = []
    for label, columns in places.items():
        if len(columns) == 1:
            names[columns[0]] = label
            continue
        kept: list[int] = []
        for column in columns:
            own = markers[:, column]
            if not np.isnan(own).all() and not any(
                np.array_equal(own, markers[:, other], equal_nan=True) for other in kept
            ):
                kept.append(column)
        if len(kept) < 2:
            names[(kept or columns)[0]] = label
            notes.append(f"{label} appears {len(columns)} times, identical or unseen.")
            continue
        number, called = 0, []
        for column in kept:
            number += 1
            while f"{label} #{number}" in places:
                number += 1
            called.append(f"{label} #{number}")
            names[column] = called[-1]
        notes.append(
            f"{len(kept)} markers are named {label}, read as {', '.join(called)}; "
            "it is unclear which of them is meant."
        )
    return [names[i] for i in sorted(names)], sorted(names), notes


def _check_extent(path: Path, recording: Recording, unit: str) -> None:
    step = -(-len(recording.time) // _EXTENT_FRAMES)
    points = recording.markers[::step].reshape(-1, 3)
    points = points[~np.isnan(points[:, 0])]
    if not len(points):
        return
    # The central nine tenths: a single ghost marker does not mean a wrong unit.
    low, high = np.percentile(points, [5, 95], axis=0)
    extent = float((high - low).max())
    # Fewer than three markers say nothing about the size of a body.
    if extent > _EXTENT[1] or (len(recording.labels) > 2 and extent < _EXTENT[0]):
        raise FileError(
            f"{path}: expected markers spread over {_EXTENT[0]:g} to {_EXTENT[1]:g} m, "
            f"found {extent:.3g} m with positions read as {unit}, so the file's unit "
            f"is probably not {unit}."
        )
