"""Vicon Workstation's ASCII export: sections in capitals, each with its own rate.

Under ``TRAJECTORIES`` stand the rate, a line of labels (each above its X), one of
component names that starts with ``Field #``, then a line per frame, in millimeters.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path

from ikns.errors import FileError
from ikns.recording.files.conversion import (
    checked_rate,
    is_unlabeled,
    meters_per,
    shown,
    to_recording,
)
from ikns.recording.files.table import Row, number_table
from ikns.recording.recording import Recording

TITLE = "TRAJECTORIES"


def read_vicon_workstation(path: Path, lines: list[str]) -> Recording:
    """Read the trajectories of a Vicon Workstation ASCII file.

    Field 1 is at 0 s, as frame 1 is in a Nexus export.
    """
    titles = [line.strip(" ,\t") for line in lines]
    start = titles.index(TITLE) + 1
    filled = [(i + 1, lines[i]) for i in range(start, len(lines)) if titles[i]]
    if len(filled) < 3:
        raise FileError(
            f"{path}: expected rate, labels and components under {TITLE}, found "
            f"{len(filled)} lines, so the file is cut off."
        )
    rate = checked_rate(path, _leading_number(filled[0][1]))
    cells = [cell.strip() for cell in filled[1][1].split(",")]
    components = [cell.strip() for cell in filled[2][1].split(",")]
    if not components[0].casefold().startswith("field"):
        raise FileError(
            f"{path}: expected 'Field #' under the labels of its trajectories, found "
            f"{shown(filled[2][1])}."
        )
    columns = {c: label for c, label in enumerate(cells) if c and label}
    if any(b - a < 3 for a, b in pairwise(columns)):
        raise FileError(
            f"{path}: expected every marker label above its X, followed by two empty "
            f"cells for Y and Z, found {shown(filled[1][1])}."
        )
    for c, label in columns.items():
        if components[c : c + 3] != ["X", "Y", "Z"]:
            raise FileError(
                f"{path}: expected X, Y and Z under marker {shown(label)}, found "
                f"{shown(' '.join(components[c : c + 3]))}."
            )
    rows = _frames(filled[3:])
    width = max(len(components), max(columns, default=0) + 3)
    table = number_table(path, rows, width, delimiter=",")
    named = {c: label for c, label in columns.items() if not is_unlabeled(label)}
    xyz = [c + k for c in named for k in range(3)]
    markers = table[:, xyz].reshape(len(table), len(named), 3)
    return to_recording(
        path,
        (table[:, 0] - 1) / rate,
        markers * meters_per(path, "mm"),
        list(named.values()),
        unit="mm",
    )


def _frames(rows: list[Row]) -> list[Row]:
    """Return the rows before the title of the next section."""
    for at, (_, line) in enumerate(rows):
        if re.fullmatch(r"[A-Z][A-Z ]+[ ,\t]*", line.strip()):
            return rows[:at]
    return rows


def _leading_number(line: str) -> float:
    """Return the number of a line such as ``100,Hz``; NaN when there is none."""
    try:
        return float(line.split(",")[0])
    except ValueError:
        return math.nan
