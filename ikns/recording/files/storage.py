"""MOT and STO, the tables in which OpenSim keeps joint angles over time.

A header of ``key=value`` lines ends with ``endheader``; then come the names of the
columns, the first of which is ``time``, and a line of numbers per frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError, InvalidInput
from ikns.output.file import write_text
from ikns.recording.files.conversion import shown
from ikns.recording.files.table import number_table, separated_rows, text_lines

#: Endings of such files.
STORAGE = (".mot", ".sto")


@dataclass(frozen=True, eq=False)
class CoordinateTable:
    """Values of named coordinates over time.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    names : tuple of n str
    values : (T, n) array
        Angles in degrees if `in_degrees`, else in radians; lengths in meters.
    in_degrees : bool
    """

    time: Array
    names: tuple[str, ...]
    values: Array
    in_degrees: bool


def read_storage(path: Path) -> CoordinateTable:
    """Read a MOT or STO file, of OpenSim or of another program.

    Coordinates that carry a path, ``/jointset/elbow/elbow_flexion/value``, get their
    bare name; columns of speeds of such a file are left out.
    """
    lines = text_lines(path)
    end = next(
        (i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None
    )
    if end is None or end + 1 >= len(lines):
        raise FileError(
            f"{path}: expected a header that ends with 'endheader', as a file of "
            f"OpenSim has, found {shown(lines[0])}."
        )
    header = {
        key.strip().lower(): value.strip().lower()
        for key, _, value in (line.partition("=") for line in lines[:end])
    }
    kind = header.get("datatype", "double")
    if kind != "double":
        raise FileError(
            f"{path}: expected one number for each coordinate, found the DataType "
            f"{shown(kind)}; run OpenSim's inverse kinematics on it first."
        )
    names = lines[end + 1].split()
    if not names or names[0].lower() != "time":
        raise FileError(
            f"{path}: expected names of columns that start with time, found "
            f"{shown(lines[end + 1])}."
        )
    rows = [(i + 1, lines[i]) for i in range(end + 2, len(lines)) if lines[i].strip()]
    rows, _ = separated_rows(path, rows)
    table = number_table(path, rows, len(names), delimiter="\t")
    time = table[:, 0]
    if not len(time) or not (np.diff(time) > 0).all() or not np.isfinite(time).all():
        raise FileError(f"{path}: expected a time that increases from row to row.")
    kept = [i for i, name in enumerate(names) if i and not name.endswith("/speed")]
    bare = [_bare(names[i]) for i in kept]
    repeated = sorted({name for name in bare if bare.count(name) > 1})
    if repeated:
        raise FileError(
            f"{path}: expected each column once, found {', '.join(repeated)} twice."
        )
    in_degrees = header.get("indegrees", "no") in ("yes", "true", "1")
    return CoordinateTable(time, tuple(bare), table[:, kept], in_degrees)


def write_storage(path: Path, table: CoordinateTable, *, force: bool = False) -> None:
    """Write a MOT or STO file; a file that exists is replaced only with `force`.

    Raises
    ------
    InvalidInput
        When a value is missing: some of OpenSim's readers end at the first one and say
        nothing.
    """
    if not np.isfinite(table.values).all():
        raise InvalidInput(
            f"{path}: expected a number for every coordinate in every frame, as "
            f"OpenSim's files cannot have gaps, found some missing."
        )
    header = [
        path.stem,
        "version=1",
        f"nRows={len(table.time)}",
        f"nColumns={1 + len(table.names)}",
        f"inDegrees={'yes' if table.in_degrees else 'no'}",
        "endheader",
        "\t".join(["time", *table.names]),
    ]
    rows = np.column_stack([table.time, table.values])
    lines = ["\t".join(f"{value:.10g}" for value in row) for row in rows]
    write_text(path, "\n".join([*header, *lines]) + "\n", force=force)


def complete_frames(
    time: Array, names: Sequence[str], values: Array, *, in_degrees: bool
) -> CoordinateTable:
    """Leave out what OpenSim's files cannot hold: unknown values.

    Columns without any value go, then the frames in which one is still missing.
    """
    known = np.isfinite(values)
    columns = np.asarray(known.any(axis=0))
    frames = known[:, columns].all(axis=1) & columns.any()
    return CoordinateTable(
        time[frames],
        tuple(name for name, kept in zip(names, columns, strict=True) if kept),
        values[frames][:, columns],
        in_degrees,
    )


def _bare(name: str) -> str:
    """Return the coordinate of a path in a model; other names stay."""
    parts = name.removesuffix("/value").split("/")
    return parts[-1] if name.startswith("/") else name
