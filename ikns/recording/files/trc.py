"""TRC, the tab-separated marker file of Motion Analysis and OpenSim.

Three lines of header, one of labels (each above its X, Y and Z), one of component
names, then a line per frame: number, time, positions. Many programs write it almost so;
what a file means beyond doubt is read, and what contradicts itself is noted.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError
from ikns.recording.files.conversion import (
    checked_rate,
    frame_times,
    is_unlabeled,
    meters_per,
    shown,
    to_recording,
)
from ikns.recording.files.table import Row, number_table, separated_rows, text_lines
from ikns.recording.files.trc_labels import place_labels
from ikns.recording.recording import Recording

#: Lines before the first frame: three of header, labels, components; a blank one may
#: follow them.
_HEADER = 5


def read_trc(path: Path) -> Recording:
    """Read a TRC file.

    Times are computed from frame number and rate where these agree with the printed
    times to half a frame, as printed times are rounded; else the printed ones are used.

    Columns may be separated by blanks or commas, numbers may have decimal commas, and
    labels may stand without gaps or shifted, wherever that leaves no doubt. A wrong
    number of frames or markers, columns without a label and a rate of 0 are noted.
    """
    notes: list[str] = []
    lines = text_lines(path)
    lines[0] = lines[0].lstrip()
    if not lines[0].startswith("PathFileType"):
        raise FileError(
            f"{path}: expected a TRC file, whose first word is PathFileType, "
            f"found {shown(lines[0])}."
        )
    if "(X/Y)" in lines[0]:
        raise FileError(
            f"{path}: expected a TRC file with X, Y and Z, found one of X and Y only."
        )
    if lines[0].startswith("PathFileType,"):
        notes.append("its columns are separated by commas instead of tabs.")
        lines = [line.replace(",", "\t") for line in lines]
    if len(lines) < _HEADER:
        raise FileError(
            f"{path}: expected {_HEADER} header lines, found {len(lines)}, so the file "
            f"is cut off."
        )
    header = _header(lines[1], lines[2])
    unit = _entry(path, header, "Units")
    meters = meters_per(path, unit)
    rate = _number(path, header, "DataRate", empty=0.0)
    if rate != 0:
        rate = checked_rate(path, rate)
    labels_at, first = _first_lines(lines)
    rows = [(i + 1, lines[i]) for i in range(first, len(lines)) if lines[i].strip()]
    n_frames = _number(path, header, "NumFrames", empty=math.nan)
    rows = _whole(rows, n_frames, lines[-1], notes)
    rows, widths = separated_rows(path, rows)
    # A column that only a few rows have is damage, not a marker without a label.
    width = int(np.median(widths)) if rows else 0
    said = _number(path, header, "NumMarkers", empty=math.nan)
    labels = place_labels(path, lines[labels_at], width, said, notes)
    values = number_table(path, rows, max(2 + 3 * len(labels), width), delimiter="\t")
    named = [i for i, label in enumerate(labels) if not is_unlabeled(label)]
    markers = values[:, 2 : 2 + 3 * len(labels)].reshape(len(rows), len(labels), 3)
    time = _time(path, values[:, 0], values[:, 1], rate, notes)
    return to_recording(
        path,
        time,
        markers[:, named] * meters,
        [labels[i] for i in named],
        unit=unit,
        notes=notes,
    )


def _header(names: str, values: str) -> dict[str, str]:
    """Return the entries of the header; values may be padded with tabs and blanks."""
    keys, found = names.split(), values.split()
    if len(keys) == len(found):
        return dict(zip(keys, found, strict=True))
    pairs = zip(names.split("\t"), values.split("\t"), strict=False)
    return {key.strip(): value.strip() for key, value in pairs}


def _first_lines(lines: list[str]) -> tuple[int, int]:
    """Return the lines of the labels and of the first frame, counted from 0."""
    filled = [i for i in range(3, len(lines)) if lines[i].strip()]
    if len(filled) < 2:
        return 3, len(lines)
    return filled[0], filled[1] + (not _starts_with_number(lines[filled[1]]))


def _whole(
    rows: list[Row], n_frames: float, last_line: str, notes: list[str]
) -> list[Row]:
    """Note a wrong number of frames; leave out a last one that is cut off."""
    if n_frames == len(rows) or math.isnan(n_frames):
        return rows
    found, cut = len(rows), ""
    if n_frames > found > 1 and last_line.strip():
        rows = rows[:-1]
        cut = "; the last line is cut off and left out"
    notes.append(
        f"its header says {n_frames:g} frames, found {found}, so the file was cut "
        f"off or edited{cut}."
    )
    return rows


def _time(
    path: Path, frame: Array, printed: Array, rate: float, notes: list[str]
) -> Array:
    """Return the time of each frame, s."""
    if not len(frame):
        return printed
    timed = not np.isnan(printed).any()
    if not (np.diff(frame) > 0).all() or np.isnan(frame).any():
        # Some writers leave the numbers out, or repeat one.
        if not timed or np.unique(frame[~np.isnan(frame)]).size > 1:
            raise FileError(
                f"{path}: expected frame numbers that increase from line to line, "
                f"found some that do not, so the file is damaged."
            )
        notes.append("its frames have no numbers; the times count.")
        return printed
    if rate == 0:
        if not timed or len(frame) < 2:
            raise FileError(
                f"{path}: expected a DataRate or times, found a rate of 0 and no times."
            )
        found = 1 / float(np.median(np.diff(printed)))
        notes.append(f"its header says 0 frames per second, its times {found:.4g}.")
        return printed
    return frame_times(frame, printed, rate, notes)


def _starts_with_number(line: str) -> bool:
    try:
        float(line.split()[0].replace(",", "."))
    except (ValueError, IndexError):
        return False
    return True


def _entry(path: Path, header: dict[str, str], name: str) -> str:
    try:
        return header[name]
    except KeyError:
        raise FileError(
            f"{path}: expected {name} in line 2 of a TRC file, found only "
            f"{shown(' '.join(header))}."
        ) from None


def _number(path: Path, header: dict[str, str], name: str, *, empty: float) -> float:
    text = _entry(path, header, name)
    if not text:
        return empty
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise FileError(
            f"{path}: expected a number for {name}, found {shown(text)}."
        ) from None
