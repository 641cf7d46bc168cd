"""Reads visits: their headers and all their attempts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ikns.errors import FileError
from ikns.experiments.visits.header import HEADER, read_header
from ikns.experiments.visits.parquet import read_rows
from ikns.experiments.visits.sums import check_sums
from ikns.output.inputs import no_such_folder


@dataclass(frozen=True, eq=False)
class VisitRecord:
    """A visit that was read from disk.

    Parameters
    ----------
    folder : Path
    about : dict
        Content of ``visit.json``.
    attempts : list of dict
        In the order in which they were made; ``time`` and ``c`` of tracking attempts
        are arrays.
    """

    folder: Path
    about: dict[str, Any]
    attempts: list[dict[str, Any]]


def read_visit(folder: str | Path, *, experiment: str | None = None) -> VisitRecord:
    """Read a visit with all its attempts.

    Parameters
    ----------
    folder : str or Path
    experiment : {"tracking", "picking"}, optional
        The experiment that it must be of.

    Raises
    ------
    FileError
        When it is of another format or experiment, or a file is missing or damaged.
        Unfinished files are ignored.
    """
    path = Path(folder)
    about = read_header(path)
    found = about["experiment"]
    if experiment is not None and found != experiment:
        raise FileError(f"{path}: expected a visit of {experiment}, found {found}.")
    try:
        check_sums(path)
    except FileError as error:
        reason = str(error).rstrip(".")
        raise FileError(f"{reason}; `ikns study run` simulates it again.") from None
    attempts = [row for file in _attempt_files(path) for row in read_rows(file, found)]
    attempts.sort(key=lambda row: row["number"])
    for expected, row in enumerate(attempts, start=1):
        if row["number"] != expected:
            fault = "twice" if row["number"] < expected else "missing"
            number = min(row["number"], expected)
            raise FileError(
                f"{path}: expected attempts 1 to {attempts[-1]['number']}, found "
                f"number {number} {fault}."
            )
    return VisitRecord(path, about, attempts)


def list_visits(study: str | Path) -> list[Path]:
    """Return the folders of all visits of a study, without reading them.

    Those without a variation come first, then each variation, sorted by name.

    Raises
    ------
    FileError
        When there is no such study folder.
    """
    return [path for path in _visit_folders(study) if _is_visit(path)]


def empty_visits(study: str | Path) -> list[Path]:
    """Return the folders of a study that are named like visits but hold none.

    See :func:`list_visits` for their order and for errors.
    """
    return [path for path in _visit_folders(study) if not _is_visit(path)]


def has_attempts(visit: Path) -> bool:
    """Whether a visit has any file of attempts, without reading it."""
    return bool(_attempt_files(visit))


def _visit_folders(study: str | Path) -> list[Path]:
    top = Path(study)
    if not top.is_dir():
        raise FileError(no_such_folder(top, "a study", "the folder of a study"))
    visits = top / "visits"
    found = sorted(p for p in visits.glob("sub-*") if p.is_dir())
    return found + sorted(
        p for p in visits.glob("*/sub-*") if p.is_dir() and p.parent.name[0] != "."
    )


def _attempt_files(visit: Path) -> list[Path]:
    """Return the files of attempts, unfinished ones excluded."""
    return [p for p in sorted(visit.glob("*.parquet")) if not p.name.startswith(".")]


def _is_visit(path: Path) -> bool:
    """Whether a folder is a visit, even a damaged one."""
    return (path / HEADER).exists() or has_attempts(path)
