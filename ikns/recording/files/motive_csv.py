"""OptiTrack Motive's CSV export.

A line of keys and values, then lines of header, of which the first says what a column
belongs to (a marker, a bone, a rigid body), the second its name, the last but one
whether it is a position or a rotation, and the last the axis; then a line per frame:
number, time, values. Versions differ in the lines between.
"""

from __future__ import annotations

import csv
from pathlib import Path

from ikns.errors import FileError
from ikns.recording.files.conversion import (
    checked_rate,
    frame_times,
    is_unlabeled,
    meters_per,
    shown,
    to_recording,
)
from ikns.recording.files.table import number_table
from ikns.recording.recording import Recording

FIRST_WORDS = "Format Version"

#: Kinds of columns that are places of markers: as the cameras saw them, else as the
#: solver of a skeleton or a rigid body placed them.
_MEASURED = ("marker",)
_SOLVED = ("bone marker", "rigid body marker", "skeleton marker")

#: Fewest header lines before the first frame, and most.
_LINES = (4, 7)


def read_motive_csv(path: Path, lines: list[str]) -> Recording:
    """Read the markers of a Motive CSV export.

    Frame 0 is at 0 s. Labels keep their prefix, ``Skeleton:RSHO``. Markers that were
    solved, not seen, are read only where a file has no others.
    """
    first = next(csv.reader(lines[:1]))
    header = {
        k.strip(): v.strip() for k, v in zip(first[::2], first[1::2], strict=False)
    }
    rate = checked_rate(path, _rate(path, header))
    notes: list[str] = []
    unit = header.get("Length Units", "")
    if not unit:
        unit = "meters"
        notes.append("it states no Length Units, read as meters.")
    meters = meters_per(path, unit)
    rows = [(i + 1, line) for i, line in enumerate(lines) if i and line.strip(" ,\t")]
    head = [row for row in rows[: _LINES[1]] if not _is_frame(row[1])]
    head = head[: next((i for i, r in enumerate(head) if r != rows[i]), len(head))]
    if len(head) < _LINES[0]:
        raise FileError(
            f"{path}: expected kinds, names, components and axes of the columns of a "
            f"Motive export, found {len(head)} lines, so the file is cut off."
        )
    cells = [row for row in csv.reader(line for _, line in head)]
    width = len(cells[-1])
    kinds, names, parts, axes = (
        [cell.strip() for cell in (cells[i] + [""] * width)[:width]]
        for i in (0, 1, -2, -1)
    )
    columns, labels = _markers(path, kinds, names, parts, axes)
    solved = bool(columns) and kinds[columns[0]].casefold() in _SOLVED
    if solved:
        _refuse_local(path, header)
        notes.append("its markers were placed by a solver, not measured.")
    wanted = [0, 1, *(c + k for c in columns for k in range(3))]
    frames = [
        (n, _picked(path, n, line, width, wanted)) for n, line in rows[len(head) :]
    ]
    table = number_table(path, frames, len(wanted), delimiter=",")
    markers = table[:, 2:].reshape(len(table), len(columns), 3) * meters
    time = table[:, 1]
    if len(time):
        time = frame_times(table[:, 0], time, rate, notes, zero=0)
    return to_recording(path, time, markers, labels, unit=unit, notes=notes)


def _markers(
    path: Path, kinds: list[str], names: list[str], parts: list[str], axes: list[str]
) -> tuple[list[int], list[str]]:
    """Return the first column of each named marker, and the names."""
    for wanted in (_MEASURED, _SOLVED):
        columns = [
            c
            for c in range(2, len(axes))
            if kinds[c].casefold() in wanted
            and parts[c].casefold() == "position"
            and axes[c : c + 3] == ["X", "Y", "Z"]
            and len({*names[c : c + 3]}) == 1
            and not is_unlabeled(names[c])
        ]
        if columns:
            return columns, [names[c] for c in columns]
    found = ", ".join(sorted({kind for kind in kinds if kind})) or "none"
    raise FileError(
        f"{path}: expected a Motive export with named markers, found columns of "
        f"{shown(found)}; export it again with Markers switched on."
    )


def _picked(path: Path, number: int, line: str, width: int, wanted: list[int]) -> str:
    """Return these cells of a line; others may be no numbers, such as a time code."""
    cells = line.split(",")
    if any(cell.strip() for cell in cells[width:]):
        raise FileError(
            f"{path}: expected {width} columns as in its header, found {len(cells)} in "
            f"line {number}."
        )
    cells += [""] * (width - len(cells))
    return ",".join(cells[c] for c in wanted)


def _rate(path: Path, header: dict[str, str]) -> float:
    for key in ("Export Frame Rate", "Capture Frame Rate"):
        if key in header:
            try:
                return float(header[key])
            except ValueError:
                raise FileError(
                    f"{path}: expected a number for {key}, found {shown(header[key])}."
                ) from None
    raise FileError(
        f"{path}: expected Export Frame Rate in line 1 of a Motive export, found "
        f"{shown(', '.join(header))}."
    )


def _refuse_local(path: Path, header: dict[str, str]) -> None:
    if header.get("Coordinate Space", "Global").casefold() != "global":
        raise FileError(
            f"{path}: expected positions in the Coordinate Space Global, found "
            f"{shown(header['Coordinate Space'])}; export it again."
        )


def _is_frame(line: str) -> bool:
    try:
        float(line.split(",", 1)[0])
    except ValueError:
        return False
    return True
