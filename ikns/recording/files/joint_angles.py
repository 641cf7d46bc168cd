"""Joint angles of a robot from a CSV file."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError

#: Endings of a column's name, and the unit that each stands for, in rad or m.
_UNITS = {"_rad": 1.0, "_m": 1.0, "_deg": 0.017453292519943295}


def read_joint_angles(path: Path, joint_names: Sequence[str]) -> tuple[Array, Array]:
    """Read time (T,), s, and joint positions (T, n), rad or m, of a robot.

    A CSV with a column ``time_s`` and one for each joint: ``<joint>_rad``,
    ``<joint>_deg``, or ``<joint>_m`` of a sliding joint. Others are ignored; rows in
    which a value is missing are left out.
    """
    header, table = _number_table(path)
    columns = {"time_s": (header.index("time_s"), 1.0)} if "time_s" in header else {}
    for place, name in enumerate(header):
        for ending, unit in _UNITS.items():
            if name.endswith(ending):
                columns.setdefault(name.removesuffix(ending), (place, unit))
    missing = [name for name in ("time_s", *joint_names) if name not in columns]
    if missing:
        raise FileError(
            f"{path}: expected the columns time_s and JOINT_rad, found none for "
            f"{', '.join(missing)}."
        )
    wanted = [columns[name] for name in ("time_s", *joint_names)]
    values = np.stack([unit * table[:, place] for place, unit in wanted], axis=1)
    values = values[np.isfinite(values).all(axis=1)]
    if len(values) < 2 or not (np.diff(values[:, 0]) > 0).all():
        raise FileError(f"{path}: expected a time_s that increases from row to row.")
    return values[:, 0], values[:, 1:]


def _number_table(path: Path) -> tuple[list[str], Array]:
    """Header and numbers of a CSV file with two rows or more; empty cells are NaN."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = list(csv.reader(file)) or [[]]
        uneven = [i for i, row in enumerate(rows, 2) if len(row) != len(header)]
        if uneven:
            raise ValueError(f"line {uneven[0]} has not {len(header)} cells")
        table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    except (OSError, ValueError) as error:
        raise FileError(
            f"{path}: cannot be read as a table of numbers: {error}."
        ) from None
    if len(rows) < 2:
        raise FileError(
            f"{path}: expected a header and two rows or more, found {len(rows)} rows."
        )
    return header, table
