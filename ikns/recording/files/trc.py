"""TRC, the tab-separated marker file of Motion Analysis and OpenSim.

Three lines of header, one of labels (each above its X, Y and Z), one of component
names, then a line per frame: number, time, positions.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError
from ikns.recording.files.conversion import (
    checked_rate,
    is_unlabeled,
    meters_per,
    shown,
    to_recording,
)
from ikns.recording.files.table import number_table, text_lines
from ikns.recording.recording import Recording

#: Lines before the first frame; a blank one may follow them.
_HEADER = 5


def read_trc(path: Path) -> Recording:
    """Read a TRC file.

    Times are computed from frame number and rate where these agree with the printed
    times to half a frame, as printed times are rounded; else the printed ones are used.
    """
    lines = text_lines(path)
    if not lines[0].startswith("PathFileType"):
        raise FileError(
            f"{path}: expected a TRC file, whose first word is PathFileType, "
            f"found {shown(lines[0])}."
        )
    if lines[0].startswith("PathFileType,"):
        raise FileError(
            f"{path}: expected a TRC file, whose columns are separated by tabs, found "
            f"columns separated by commas; export it again as tab-separated TRC."
        )
    if len(lines) < _HEADER:
        raise FileError(
            f"{path}: expected {_HEADER} header lines, found {len(lines)}, so the file "
            f"is cut off."
        )
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    unit = _entry(path, header, "Units")
    meters = meters_per(path, unit)
    rate = checked_rate(path, _number(path, header, "DataRate"))
    labels = [cell.strip() for cell in lines[3].split("\t")[2:]]
    while labels and not labels[-1]:
        labels.pop()
    if any(labels[1::3]) or any(labels[2::3]):
        raise FileError(
            f"{path}: expected every marker label above its X, followed by two empty "
            f"cells for Y and Z, found {shown(lines[3])}."
        )
    labels = labels[::3]
    n_markers = _number(path, header, "NumMarkers")
    if n_markers != len(labels):
        raise FileError(
            f"{path}: expected {n_markers:g} markers as its header says, found "
            f"{len(labels)} labels."
        )
    rows = [(i + 1, lines[i]) for i in range(_HEADER, len(lines)) if lines[i].strip()]
    n_frames = _number(path, header, "NumFrames")
    if n_frames != len(rows):
        raise FileError(
            f"{path}: expected {n_frames:g} frames as its header says, found "
            f"{len(rows)}, so the file is cut off or was edited."
        )
    values = number_table(path, rows, 2 + 3 * len(labels), delimiter="\t")
    named = [i for i, label in enumerate(labels) if not is_unlabeled(label)]
    markers = values[:, 2:].reshape(len(rows), len(labels), 3)[:, named] * meters
    if not (np.diff(values[:, 0]) > 0).all():
        raise FileError(
            f"{path}: expected frame numbers that increase from line to line, found "
            f"some that do not, so the file is damaged."
        )
    time = _time(values[:, 0], values[:, 1], rate)
    return to_recording(path, time, markers, [labels[i] for i in named], unit=unit)


def _time(frame: Array, printed: Array, rate: float) -> Array:
    if not len(frame):
        return printed
    steps = (frame - frame[0]) / rate
    if np.isnan(printed).all():
        return (frame[0] - 1) / rate + steps
    exact = printed[0] + steps
    return exact if np.abs(printed - exact).max() < 0.5 / rate else printed


def _entry(path: Path, header: dict[str, str], name: str) -> str:
    try:
        return header[name].strip()
    except KeyError:
        raise FileError(
            f"{path}: expected {name} in line 2 of a TRC file, found only "
            f"{shown(' '.join(header))}."
        ) from None


def _number(path: Path, header: dict[str, str], name: str) -> float:
    text = _entry(path, header, name)
    try:
        return float(text)
    except ValueError:
        raise FileError(
            f"{path}: expected a number for {name}, found {shown(text)}."
        ) from None
