"""Writes visits: each file appears whole or not at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput, plain
from ikns.experiments.visits.header import FORMAT, HEADER, header_fault, read_header
from ikns.experiments.visits.lock import LOCK
from ikns.experiments.visits.parquet import table_bytes
from ikns.experiments.visits.sums import SUMS, sums_bytes
from ikns.output.file import create_bytes, sync

_ALL_ATTEMPTS = "attempts.parquet"
#: End of the name of an unfinished file, which is never read.
_PART = ".part"


def create_visit(folder: str | Path, about: Mapping[str, Any]) -> Path:
    """Create the folder of a visit with its ``visit.json``.

    Parameters
    ----------
    folder : str or Path
        New or empty; its parents are created.
    about : mapping
        Content of ``visit.json``; ``experiment``, ``participant`` and ``simulated`` are
        required, ``format`` is added.

    Raises
    ------
    InvalidInput
        When the folder is not empty, or `about` is not the header of a visit.
    FileError
        When it cannot be written.
    """
    path = Path(folder)
    header = _header_bytes(path, about)
    if path.exists() and not path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a folder, found a file.")
    held = [p.name for p in path.iterdir()] if path.exists() else []
    held = [n for n in sorted(held) if not n.endswith(_PART) and n != LOCK]
    if held:
        raise InvalidInput(
            f"{path}: expected a new folder for a visit, found one that holds "
            f"{held[0]}."
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be created: {plain(error)}.") from None
    _write(path / HEADER, header)
    return path


def append_attempt(folder: str | Path, row: Mapping[str, Any]) -> Path:
    """Write an attempt as a file of its own.

    After a crash at any time the file is there whole, or not at all.

    Parameters
    ----------
    folder : str or Path
        From :func:`create_visit`.
    row : mapping
        With the columns of the experiment, as from
        :func:`ikns.experiments.visits.tracking_row`.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InvalidInput
        When an attempt with this number exists, or the row lacks a column.
    FileError
        When the folder is no visit, or cannot be written.
    """
    path = Path(folder)
    content = table_bytes(read_header(path)["experiment"], [row])
    return _write(path / f"attempt-{int(row['number']):04d}.parquet", content)


def write_attempts(folder: str | Path, rows: Iterable[Mapping[str, Any]]) -> Path:
    """Write all attempts of a visit as one file; see :func:`append_attempt`."""
    path = Path(folder)
    content = table_bytes(read_header(path)["experiment"], list(rows))
    return _write(path / _ALL_ATTEMPTS, content)


def write_visit(
    folder: str | Path,
    about: Mapping[str, Any],
    attempts: bytes,
    others: Mapping[str, bytes] | None = None,
) -> Path:
    """Write a finished visit: the folder appears whole or not at all.

    With it goes ``sums.sha256``, by which damage is noticed later.

    Parameters
    ----------
    folder : str or Path
        New; its parents are created. An unfinished folder of the same visit, left by a
        killed run under another name, is removed.
    about : mapping
        See :func:`create_visit`.
    attempts : bytes
        From :func:`ikns.experiments.visits.table_bytes`.
    others : mapping of str to bytes, optional
        Other files, by their names in the folder, such as ``subject/map.json``.

    Raises
    ------
    InvalidInput
        When the folder exists, or `about` is not the header of a visit.
    FileError
        When it cannot be written.
    """
    path = Path(folder)
    if path.exists():
        raise InvalidInput(f"{path}: already exists, and no visit is overwritten.")
    part = path.with_name(f".{path.name}{_PART}")
    shutil.rmtree(part, ignore_errors=True)
    create_visit(part, about)
    files = {_ALL_ATTEMPTS: attempts} | dict(others or {})
    sums = sums_bytes({HEADER: _header_bytes(path, about)} | files)
    for name, content in (files | {SUMS: sums}).items():
        (part / name).parent.mkdir(exist_ok=True)
        _write(part / name, content)
    try:
        part.rename(path)
        sync(path.parent)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {plain(error)}.") from None
    return path


def _header_bytes(visit: Path, about: Mapping[str, Any]) -> bytes:
    table = {"format": FORMAT} | dict(about) | {"format": FORMAT}
    fault = header_fault(table)
    if fault:
        raise InvalidInput(f"{visit}: {fault}.")
    try:
        return (json.dumps(table, indent=1, allow_nan=False) + "\n").encode()
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{visit}: expected text, numbers and lists in {HEADER} ({error})."
        ) from None


def _write(path: Path, content: bytes) -> Path:
    """Write a new file; of several writers one succeeds."""
    try:
        new = create_bytes(path, content)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {plain(error)}.") from None
    if not new:
        kind = "visit" if path.name == HEADER else "attempt"
        raise InvalidInput(f"{path}: already exists, and no {kind} is overwritten.")
    return path
