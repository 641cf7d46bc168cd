"""Vicon Nexus' ASCII export: consecutive sections, each with its own rate.

Only the section named Trajectories holds markers: a line with its rate, a line of
labels (each above its X), one of component names, one of units, then one per frame.
"""

from __future__ import annotations

import math
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


def read_vicon_csv(path: Path, lines: list[str]) -> Recording:
    """Read the trajectories of a Vicon Nexus CSV export.

    Frame 1 is at 0 s, as in the C3D and TRC files of the same trial. Other sections
    (devices, model outputs, joints) are ignored.
    """
    head, rows = _trajectories(path, lines)
    rate = checked_rate(path, _number(head[0]))
    label_row, components, units = (line.split(",") for line in head[1:])
    if [cell.strip() for cell in components[:2]] != ["Frame", "Sub Frame"]:
        raise FileError(
            f"{path}: expected the columns 'Frame' and 'Sub Frame' under the labels of "
            f"its trajectories, found {shown(','.join(components))}."
        )
    columns = {
        c: label.strip() for c, label in enumerate(label_row) if c > 1 and label.strip()
    }
    for c, label in columns.items():
        if [cell.strip() for cell in components[c : c + 3]] != ["X", "Y", "Z"]:
            raise FileError(
                f"{path}: expected X, Y and Z under marker {shown(label)}, found "
                f"{shown(' '.join(components[c : c + 3]))}."
            )
    named = {c: label for c, label in columns.items() if not is_unlabeled(label)}
    found = {unit.strip() for c in named for unit in units[c : c + 3]} or {"mm"}
    if len(found) > 1:
        raise FileError(
            f"{path}: expected one unit for all trajectories, found "
            f"{shown(', '.join(sorted(found)))}."
        )
    unit = found.pop()
    meters = meters_per(path, unit)
    width = max(columns, default=-1) + 3
    table = number_table(path, rows, max(width, len(components)), delimiter=",")
    xyz = [c + k for c in named for k in range(3)]
    markers = table[:, xyz].reshape(len(table), len(named), 3) * meters
    time = (table[:, 0] - 1) / rate
    return to_recording(path, time, markers, list(named.values()), unit=unit)


def _trajectories(path: Path, lines: list[str]) -> tuple[list[str], list[Row]]:
    """Return four header lines and the numbered lines of frames, without blanks."""
    filled = [(i + 1, line) for i, line in enumerate(lines) if line.strip(" ,\t")]
    titles = [line.strip(" ,\t\"'") for _, line in filled]
    if "Trajectories" not in titles:
        raise FileError(
            f"{path}: expected a Vicon Nexus export with a section named Trajectories, "
            f"or one of Vicon Workstation or OptiTrack Motive, found a file that "
            f"starts with {shown(titles[0] if titles else '')}."
        )
    section = filled[titles.index("Trajectories") + 1 :]
    if len(section) < 4:
        raise FileError(
            f"{path}: expected rate, labels, components and units under Trajectories, "
            f"found {len(section)} lines, so the file is cut off."
        )
    end = 4
    while end < len(section) and not _is_title(section[end][1]):
        end += 1
    return [line for _, line in section[:4]], section[4:end]


def _is_title(line: str) -> bool:
    """Whether a line names the next section: words in the first cell only."""
    first, _, rest = line.partition(",")
    return not rest.strip(" ,\t") and math.isnan(_number(first))


def _number(text: str) -> float:
    try:
        return float(text.strip(" ,\t\"'"))
    except ValueError:
        return math.nan
