"""A visit's folder: ``visit.json`` and its attempts, written whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput
from ikns.experiments.visits.parquet import read_rows, table_bytes
from ikns.experiments.visits.rows import EXPERIMENTS

__all__ = [
    "FORMAT",
    "VisitRecord",
    "append_attempt",
    "create_visit",
    "list_visits",
    "read_visit",
    "write_attempts",
    "write_visit",
]

#: Version of a visit's files.
FORMAT = 1
_ABOUT, _ALL = "visit.json", "attempts.parquet"
#: What a file is called until it is whole; such a file is never read.
_PART = ".part"


@dataclass(frozen=True, eq=False)
class VisitRecord:
    """A visit as it was read.

    Parameters
    ----------
    folder : Path
    about : dict
        Of ``visit.json``.
    attempts : list of dict
        In the order in which they were made; ``time`` and ``c`` of a tracking attempt
        are arrays.
    """

    folder: Path
    about: dict[str, Any]
    attempts: list[dict[str, Any]]


def create_visit(folder: str | Path, about: Mapping[str, Any]) -> Path:
    """Begin a visit: make its folder and write down what it is.

    Parameters
    ----------
    folder : str or Path
        New or empty; folders above it are made.
    about : mapping
        Goes into ``visit.json``; ``experiment``, ``participant`` and ``simulated`` must
        be there. ``format`` is added.

    Raises
    ------
    InvalidInput
        When the folder holds something, or `about` is not what a visit is.
    FileError
        When it cannot be written.
    """
    path = Path(folder)
    table = {"format": FORMAT} | dict(about) | {"format": FORMAT}
    fault = _fault(table)
    if fault:
        raise InvalidInput(f"{path}: {fault}.")
    try:
        text = json.dumps(table, indent=1, allow_nan=False) + "\n"
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{path}: expected text, numbers and lists in {_ABOUT} ({error})."
        ) from None
    if path.exists() and not path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a folder, found a file.")
    held = [p.name for p in path.iterdir()] if path.exists() else []
    held = [name for name in sorted(held) if not name.endswith(_PART)]
    if held:
        raise InvalidInput(
            f"{path}: expected a new folder for a visit, found one that holds "
            f"{held[0]}."
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be made: {error.strerror}.") from None
    _write(path / _ABOUT, text.encode())
    return path


def append_attempt(folder: str | Path, row: Mapping[str, Any]) -> Path:
    """Put an attempt on disk, as a file of its own, the moment it ends.

    After a crash at any instant the file is there whole, or not at all.

    Parameters
    ----------
    folder : str or Path
        Of :func:`create_visit`.
    row : mapping
        With the columns of the experiment, such as
        :func:`ikns.experiments.visits.tracking_row` makes.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InvalidInput
        When an attempt of that number is there, or the row lacks a column.
    FileError
        When there is no visit, or it cannot be written.
    """
    path = Path(folder)
    content = table_bytes(_about(path)["experiment"], [row])
    return _new(path / f"attempt-{int(row['number']):04d}.parquet", content)


def write_attempts(folder: str | Path, rows: Iterable[Mapping[str, Any]]) -> Path:
    """Put all attempts of a visit on disk at once; see :func:`append_attempt`."""
    path = Path(folder)
    content = table_bytes(_about(path)["experiment"], list(rows))
    return _new(path / _ALL, content)


def write_visit(
    folder: str | Path,
    about: Mapping[str, Any],
    attempts: bytes,
    others: Mapping[str, bytes] | None = None,
) -> Path:
    """Write a visit that is over: the folder appears whole or not at all.

    Parameters
    ----------
    folder : str or Path
        New; folders above it are made. What a killed run left of the same visit, which
        has another name, is removed.
    about : mapping
        See :func:`create_visit`.
    attempts : bytes
        Of :func:`ikns.experiments.visits.table_bytes`.
    others : mapping of str to bytes, optional
        Further files, by their names in the folder, such as ``subject/map.json``.

    Raises
    ------
    InvalidInput
        When the folder exists, or `about` is not what a visit is.
    FileError
        When it cannot be written.
    """
    path = Path(folder)
    if path.exists():
        raise InvalidInput(f"{path}: is there already, and no visit is overwritten.")
    part = path.with_name(f".{path.name}{_PART}")
    shutil.rmtree(part, ignore_errors=True)
    create_visit(part, about)
    _write(part / _ALL, attempts)
    for name, content in (others or {}).items():
        (part / name).parent.mkdir(exist_ok=True)
        _write(part / name, content)
    try:
        part.rename(path)
        _sync(path.parent)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}.") from None
    return path


def read_visit(folder: str | Path, *, experiment: str | None = None) -> VisitRecord:
    """Read a visit with all its attempts.

    Parameters
    ----------
    folder : str or Path
    experiment : {"tracking", "picking"}, optional
        Which one it has to be.

    Raises
    ------
    FileError
        When it is of another format or experiment, or a file is missing or damaged. A
        file that was not finished does not count as one.
    """
    path = Path(folder)
    about = _about(path)
    found = about["experiment"]
    if experiment is not None and found != experiment:
        raise FileError(f"{path}: expected a visit of {experiment}, found {found}.")
    attempts = [
        row
        for file in sorted(path.glob("*.parquet"))
        if not file.name.startswith(".")
        for row in read_rows(file, found)
    ]
    attempts.sort(key=lambda row: row["number"])
    for place, row in enumerate(attempts, start=1):
        if row["number"] != place:
            fault = "twice" if row["number"] < place else "missing"
            number = min(row["number"], place)
            raise FileError(
                f"{path}: expected attempts 1 to {attempts[-1]['number']}, found "
                f"number {number} {fault}."
            )
    return VisitRecord(path, about, attempts)


def list_visits(study: str | Path) -> list[Path]:
    """Return the folders of all visits of a study, without reading them.

    First those without a variation, then variation by variation; each by name.

    Raises
    ------
    FileError
        When there is no such study folder.
    """
    top = Path(study)
    if not top.is_dir():
        raise FileError(f"{top}: expected the folder of a study, found none.")
    visits = top / "visits"
    found = sorted(p for p in visits.glob("sub-*") if _holds(p))
    return found + sorted(
        p for p in visits.glob("*/sub-*") if _holds(p) and p.parent.name[0] != "."
    )


def _holds(path: Path) -> bool:
    """Whether it is a visit, be it a damaged one."""
    return (path / _ABOUT).exists() or any(path.glob("*.parquet"))


def _about(path: Path) -> dict[str, Any]:
    place = path / _ABOUT
    try:
        table = json.loads(place.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileError(
            f"{path}: expected a visit with {_ABOUT}, found none."
        ) from None
    except OSError as error:
        raise FileError(f"{place}: cannot be read: {error.strerror}.") from None
    except ValueError:
        raise FileError(f"{place}: cannot be read as JSON.") from None
    fault = "expected a table" if not isinstance(table, dict) else _fault(table)
    if fault:
        raise FileError(f"{place}: {fault}.")
    return dict(table)


def _fault(table: Mapping[str, Any]) -> str:
    """Say what keeps a table from being that of a visit; nothing: it is one."""
    if table.get("format") != FORMAT:
        return f"expected a visit of format {FORMAT}, found {table.get('format')}"
    if table.get("experiment") not in EXPERIMENTS:
        return (
            f"expected an experiment of {', '.join(EXPERIMENTS)}, found "
            f"{table.get('experiment')}"
        )
    if not isinstance(table.get("participant"), str):
        return f"expected a participant as text, found {table.get('participant')}"
    if not isinstance(table.get("simulated"), bool):
        return f"expected simulated true or false, found {table.get('simulated')}"
    return ""


def _new(path: Path, content: bytes) -> Path:
    if path.exists():
        raise InvalidInput(f"{path}: is there already, and no attempt is overwritten.")
    return _write(path, content)


def _write(path: Path, content: bytes) -> Path:
    """Write, bring to the disk, and only then give it its name."""
    part = path.with_name(f".{path.name}.{os.getpid()}{_PART}")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
        _sync(path.parent)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}.") from None
    finally:
        part.unlink(missing_ok=True)
    return path


def _sync(folder: Path) -> None:
    """Bring the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
