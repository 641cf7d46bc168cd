"""Joint angles of a robot from a CSV file, or from OpenSim's."""

from __future__ import annotations

import csv
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError, unreadable
from ikns.recording.files.storage import STORAGE, read_storage

_RAD = 0.017453292519943295

#: Endings of a column's name, and the unit that each stands for, in rad or m.
_UNITS = {"_rad": 1.0, "_m": 1.0, "_deg": _RAD}


def read_joint_angles(
    path: Path, joint_names: Sequence[str], *, sliding: Collection[str] = ()
) -> tuple[Array, Array]:
    """Read time (T,), s, and joint positions (T, n), rad or m, of a robot.

    Parameters
    ----------
    path : Path
        A CSV with a column ``time_s`` and one for each joint: ``<joint>_rad``,
        ``<joint>_deg``, or ``<joint>_m`` of a sliding joint. Or a ``.mot`` or ``.sto``
        file with columns named as the joints. Other columns are ignored; rows in which
        a value is missing are left out.
    joint_names : sequence of n str
    sliding : collection of str
        Joints whose values are lengths also where a file is in degrees.
    """
    names, values, units, wanted = _columns(path, sliding)
    missing = [name for name in ("time_s", *joint_names) if name not in names]
    if missing:
        raise FileError(
            f"{path}: expected the columns {wanted}, found none for "
            f"{', '.join(missing)}."
        )
    places = [names.index(name) for name in ("time_s", *joint_names)]
    table = values[:, places] * units[places]
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < 2 or not (np.diff(table[:, 0]) > 0).all():
        raise FileError(f"{path}: expected a time_s that increases from row to row.")
    return table[:, 0], table[:, 1:]


def read_angle_table(path: Path) -> tuple[Array, tuple[str, ...], Array]:
    """Read time, names and values of all joints of a CSV, deg and m.

    ``thorax_x_m`` becomes ``thorax_tx``, as OpenSim names lengths. Columns without a
    unit, and the residual, are no coordinates and are left out.
    """
    header, table = _number_table(path)
    if "time_s" not in header:
        raise FileError(f"{path}: expected a column time_s, found {header[0]!r}.")
    kept = [
        (place, _coordinate(name, ending), unit / _RAD if ending != "_m" else 1.0)
        for place, name in enumerate(header)
        for ending, unit in _UNITS.items()
        if name.endswith(ending) and name != "residual_m"
    ]
    if not kept:
        raise FileError(
            f"{path}: expected columns of joints, such as right_elbow_flexion_deg or "
            f"_rad; it has {', '.join(header)}."
        )
    time = table[:, header.index("time_s")]
    if not np.isfinite(time).all() or not (np.diff(time) > 0).all():
        raise FileError(f"{path}: expected a time_s that increases from row to row.")
    values = np.stack([unit * table[:, place] for place, _, unit in kept], axis=1)
    return time, tuple(name for _, name, _ in kept), values


def _coordinate(name: str, ending: str) -> str:
    """Return a column's name without its unit."""
    bare = name.removesuffix(ending)
    if ending == "_m" and bare[-2:] in ("_x", "_y", "_z"):
        return f"{bare[:-1]}t{bare[-1]}"
    return bare


def _columns(
    path: Path, sliding: Collection[str]
) -> tuple[list[str], Array, Array, str]:
    """Return names, numbers (T, n), units of the columns, and how they are named."""
    if path.suffix.lower() in STORAGE:
        found = read_storage(path)
        unit = _RAD if found.in_degrees else 1.0
        units = [1.0 if name in sliding else unit for name in found.names]
        values = np.column_stack([found.time, found.values])
        return (
            ["time_s", *found.names],
            values,
            np.array([1.0, *units]),
            "time and JOINT",
        )
    header, table = _number_table(path)
    columns = {"time_s": (header.index("time_s"), 1.0)} if "time_s" in header else {}
    for place, name in enumerate(header):
        for ending, unit in _UNITS.items():
            if name.endswith(ending):
                columns.setdefault(name.removesuffix(ending), (place, unit))
    places = [place for place, _ in columns.values()]
    units = [unit for _, unit in columns.values()]
    return list(columns), table[:, places], np.array(units), "time_s and JOINT_rad"


def _number_table(path: Path) -> tuple[list[str], Array]:
    """Header and numbers of a CSV file with two rows or more; empty cells are NaN."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = list(csv.reader(file)) or [[]]
        uneven = [i for i, row in enumerate(rows, 2) if len(row) != len(header)]
        if uneven:
            raise ValueError(f"line {uneven[0]} does not have {len(header)} cells")
        table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    except UnicodeDecodeError:
        raise FileError(f"{path}: this is not a text file.") from None
    except (OSError, ValueError) as error:
        raise unreadable(path, error, "a table of numbers") from None
    if len(rows) < 2:
        raise FileError(
            f"{path}: expected a header and at least 2 rows, found {len(rows)} "
            f"row{'s' * (len(rows) != 1)}."
        )
    return header, table
