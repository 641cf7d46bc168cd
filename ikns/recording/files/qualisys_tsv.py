"""Qualisys Track Manager's TSV export.

Lines of a key and its values; then, if the export was asked for it, a line of column
names; then a line per frame, in millimeters, with frame number and time before the
positions or without.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ikns.errors import FileError
from ikns.recording.files.conversion import (
    checked_rate,
    frame_times,
    is_unlabeled,
    meters_per,
    shown,
    to_recording,
)
from ikns.recording.files.table import number_table, separated_rows, text_lines
from ikns.recording.recording import Recording

#: A file starts with one of these.
_KEYS = ("NO_OF_FRAMES", "NO_OF_CAMERAS", "NO_OF_MARKERS", "FREQUENCY", "FILE_VERSION")


def read_qualisys_tsv(path: Path) -> Recording:
    """Read a Qualisys TSV export of 3-D positions; frame 1 is at 0 s."""
    lines = text_lines(path)
    if not lines[0].startswith(_KEYS):
        raise FileError(
            f"{path}: expected a TSV file of Qualisys Track Manager, which starts with "
            f"{_KEYS[0]}, found {shown(lines[0])}; export it with the TSV header."
        )
    header: dict[str, list[str]] = {}
    start = 0
    while start < len(lines) and not _is_number(lines[start].split("\t")[0]):
        key, *values = lines[start].rstrip("\t ").split("\t")
        if len(values) == 0 and len(lines[start].split()) == 2:
            key, *values = lines[start].split()  # blanks for tabs
        header.setdefault(key.strip(), [value.strip() for value in values])
        start += 1
    included = "".join(header.get("DATA_INCLUDED", ["3D"])).upper()
    if included != "3D" or "MARKER_NAMES" not in header:
        raise FileError(
            f"{path}: expected a Qualisys export of 3D data with MARKER_NAMES, found "
            f"{shown(included if included != '3D' else ', '.join(header))}."
        )
    notes: list[str] = []
    rate = checked_rate(path, _number(header, "FREQUENCY"))
    labels = header["MARKER_NAMES"]
    said = _number(header, "NO_OF_MARKERS")
    if said != len(labels):
        notes.append(f"its header says {said:g} markers, found {len(labels)} names.")
    rows = [(i + 1, lines[i]) for i in range(start, len(lines)) if lines[i].strip()]
    if _number(header, "NO_OF_FRAMES") != len(rows):
        notes.append(
            f"its header says {_number(header, 'NO_OF_FRAMES'):g} frames, found "
            f"{len(rows)}, so the file was cut off or edited."
        )
    rows, widths = separated_rows(path, rows)
    before = _columns_before(path, header, widths, len(labels))
    table = number_table(path, rows, before + 3 * len(labels), delimiter="\t")
    named = [i for i, label in enumerate(labels) if not is_unlabeled(label)]
    markers = table[:, before:].reshape(len(rows), len(labels), 3)[:, named]
    frame = table[:, 0] if before else np.arange(1.0, 1 + len(rows), dtype=np.float64)
    timed = before and np.isfinite(table[:, 1]).all()
    printed = table[:, 1] if timed else np.full(len(rows), np.nan)
    return to_recording(
        path,
        frame_times(frame, printed, rate, notes) if len(rows) else printed,
        markers * meters_per(path, "mm"),
        [labels[i] for i in named],
        unit="mm",
        notes=notes,
    )


def _columns_before(
    path: Path, header: dict[str, list[str]], widths: list[int], n_markers: int
) -> int:
    """Return how many columns stand before the first marker: 2 or none.

    Told by the line of column names, else by the width of the rows: no row that is
    complete has as many cells with frame and time as without.
    """
    if "Frame" in header:
        return 2
    widest = max(widths, default=0)
    if any(key.split(" ")[0] in header["MARKER_NAMES"] for key in header):
        return 0
    if widest in (3 * n_markers, 3 * n_markers + 2) or not widths:
        return 2 if widest == 3 * n_markers + 2 else 0
    raise FileError(
        f"{path}: expected {3 * n_markers} or {3 * n_markers + 2} columns for "
        f"{n_markers} markers, found {widest}."
    )


def _number(header: dict[str, list[str]], name: str) -> float:
    values = header.get(name, [])
    text = values[0] if values else ""
    return float(text.replace(",", ".")) if _is_number(text) else math.nan


def _is_number(text: str) -> bool:
    try:
        float(text.strip().replace(",", "."))
    except ValueError:
        return False
    return True
