"""Output files: they appear whole or not at all, and overwrite nothing unasked."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from ikns.errors import InvalidInput

__all__ = ["refuse_overwriting", "write_bytes", "write_csv", "write_text"]


def refuse_overwriting(path: Path, *, force: bool) -> None:
    """Check, before any work, that a file may be written.

    Raises
    ------
    InvalidInput
        When it exists and `force` is not set, or its folder does not exist.
    """
    if path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a file, found a folder.")
    if path.exists() and not force:
        raise InvalidInput(f"{path}: exists already; use --force to overwrite it.")
    if not path.absolute().parent.is_dir():
        raise InvalidInput(f"{path}: expected an existing folder to write into.")


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_csv(
    path: Path, columns: Sequence[str], rows: Iterable[Sequence[float]]
) -> None:
    """Write a table of numbers; NaN becomes an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(["" if v != v else f"{v:.9g}" for v in row])
    write_text(path, text.getvalue())
