"""One file into another: markers into markers, joint angles into joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.errors import FileError, InvalidInput
from ikns.output.file import write_csv
from ikns.recording.files import READABLE, WRITABLE, read, write
from ikns.recording.files.conversion import refuse_folder
from ikns.recording.files.joint_angles import read_angle_table
from ikns.recording.files.storage import (
    STORAGE,
    CoordinateTable,
    complete_frames,
    read_storage,
    write_storage,
)
from ikns.recording.files.table import text_lines
from ikns.recording.labels import renamed
from ikns.recording.part import check_order, require_rate


class Converted(NamedTuple):
    """What a conversion wrote."""

    kind: str  # "markers" or "joint angles"
    frames: int
    names: tuple[str, ...]
    duration: float  # s
    left_out: int  # frames that the new file cannot hold


def convert_file(
    source: Path,
    target: Path,
    *,
    subject_prefix: str | None = None,
    start: str | None = None,
    end: str | None = None,
    stream: str | None = None,
    names: Mapping[str, str] | None = None,
    force: bool = False,
) -> Converted:
    """Read a file and write it in the format of another ending.

    Parameters
    ----------
    source : Path
        Markers, as :func:`ikns.recording.files.read` reads them, or joint angles:
        ``.mot``, ``.sto``, or ``.csv`` with ``time_s`` and ``<joint>_deg`` columns.
    target : Path
        ``.c3d``, ``.trc`` or ``.csv`` for markers, ``.mot``, ``.sto`` or ``.csv`` for
        joint angles.
    subject_prefix, start, end, stream
        As for :func:`ikns.recording.files.read`; angles have no subject and no events.
    names : mapping, optional
        Other labels for markers, new by old, as for
        :func:`ikns.recording.labels.renamed`.
    force : bool
        Whether to replace a file that exists.

    Raises
    ------
    FileError
        When the source cannot be read.
    InvalidInput
        When the target cannot hold it.
    """
    if holds_angles(source):
        if subject_prefix is not None or stream is not None or names:
            raise InvalidInput(
                f"{source}: expected a file of markers to choose a subject or a stream "
                f"from, or to rename, found joint angles."
            )
        table = _between(source, _read_angles(source), start, end)
        return _write_angles(target, table, force=force)
    if target.suffix.lower() not in WRITABLE:
        raise InvalidInput(
            f"{target}: expected a name that ends in {', '.join(WRITABLE)} for "
            f"markers, found {target.suffix or 'no ending'}; joint angles come from "
            "`ikns ik --out`."
        )
    recording = read(
        source, subject_prefix=subject_prefix, start=start, end=end, stream=stream
    )
    require_rate(recording, part=start is not None or end is not None)
    if names:
        recording = renamed(recording, names)
    write(target, recording, force=force)
    time = recording.time
    return Converted(
        "markers",
        len(time),
        recording.labels,
        float(time[-1] - time[0]),
        0,
    )


def holds_angles(path: Path) -> bool:
    """Whether a file is one of joint angles, by its ending and its first words."""
    ending = path.suffix.lower()
    refuse_folder(path)
    if ending not in (*READABLE, *STORAGE):
        raise FileError(
            f"{path}: expected a file that ends in {', '.join((*READABLE, *STORAGE))}, "
            f"found {ending or 'no ending'}."
        )
    if ending == ".csv":
        return text_lines(path)[0].startswith("time_s,")
    return ending in STORAGE


def _read_angles(path: Path) -> CoordinateTable:
    if path.suffix.lower() in STORAGE:
        return read_storage(path)
    time, names, values = read_angle_table(path)
    return CoordinateTable(time, names, values, in_degrees=True)


def _between(
    path: Path, table: CoordinateTable, start: str | None, end: str | None
) -> CoordinateTable:
    """Return the frames between two moments."""
    limits = []
    for said, default in ((start, -np.inf), (end, np.inf)):
        try:
            limits.append(default if said is None else float(said))
        except ValueError:
            raise InvalidInput(
                f"{path}: expected a number of seconds, found {said!r}."
            ) from None
    check_order(path, *limits)
    kept = (table.time >= limits[0]) & (table.time <= limits[1])
    if not kept.any():
        raise InvalidInput(
            f"{path}: expected frames between {limits[0]:g} and {limits[1]:g} s, found "
            f"it to last from {table.time[0]:g} to {table.time[-1]:g} s."
        )
    return CoordinateTable(
        table.time[kept], table.names, table.values[kept], table.in_degrees
    )


def _write_angles(target: Path, table: CoordinateTable, *, force: bool) -> Converted:
    ending = target.suffix.lower()
    if ending in STORAGE:
        whole = complete_frames(
            table.time, table.names, table.values, in_degrees=table.in_degrees
        )
        if not len(whole.time):
            raise InvalidInput(
                f"{target}: expected a frame with all coordinates, as OpenSim's files "
                f"have no gaps, found none."
            )
        write_storage(target, whole, force=force)
    elif ending == ".csv":
        whole = table
        unit = "deg" if table.in_degrees else "rad"
        columns = ["time_s", *(_with_unit(name, unit) for name in table.names)]
        write_csv(
            target, columns, np.column_stack([table.time, table.values]), force=force
        )
    else:
        raise InvalidInput(
            f"{target}: expected a name that ends in {', '.join(STORAGE)} or .csv for "
            f"joint angles, found {target.suffix or 'no ending'}."
        )
    lost = len(table.time) - len(whole.time)
    duration = float(whole.time[-1] - whole.time[0])
    return Converted("joint angles", len(whole.time), whole.names, duration, lost)


def _with_unit(name: str, unit: str) -> str:
    """Return a column's name; OpenSim ends those of lengths in tx, ty or tz."""
    if name.endswith(("_tx", "_ty", "_tz")):
        return f"{name[:-2]}{name[-1]}_m"
    return f"{name}_{unit}"
