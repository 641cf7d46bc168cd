"""Tables of numbers in text files; gaps become NaN."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError
from ikns.recording.files.conversion import existing_file, shown

#: How Microsoft's library prints NaN, and Qualisys' software what was not seen.
_NOT_A_NUMBER = re.compile(
    r"-?1\.#(?:QNAN|SNAN|IND)\d*|(?<![a-z])null(?![a-z])", re.IGNORECASE
)

#: A line and its number in the file, from 1.
Row = tuple[int, str]


def text_lines(path: Path) -> list[str]:
    """Return a text file's lines, whatever its byte-order mark and line ends."""
    existing_file(path)
    raw = path.read_bytes()
    wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = raw.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def separated_rows(path: Path, rows: list[Row]) -> tuple[list[Row], list[int]]:
    """Return rows with tabs between the cells, and how many each has at most filled.

    Rows without tabs are separated by blanks; then no cell can be empty. Commas are
    decimal where no row has a point.
    """
    text = [line for _, line in rows]
    if not any("." in line for line in text) and any("," in line for line in text):
        text = [line.replace(",", ".") for line in text]
    # Blanks within a cell are the same: a tab that became blanks.
    if any(len(cell.split()) > 1 for line in text[:1] for cell in line.split("\t")):
        text = ["\t".join(line.split()) for line in text]
        widths = [line.count("\t") + 1 for line in text]
        uneven = next((i for i, width in enumerate(widths) if width != widths[0]), None)
        if uneven is not None:
            raise FileError(
                f"{path}: expected {widths[0]} numbers in line {rows[uneven][0]} as in "
                f"line {rows[0][0]}, found {widths[uneven]}: with blanks between the "
                f"columns an unseen marker cannot be recognized; export it again "
                f"with tabs."
            )
    else:
        widths = [line.rstrip().count("\t") + 1 for line in text]
    return [(n, line) for (n, _), line in zip(rows, text, strict=True)], widths


def number_table(
    path: Path, rows: list[Row], n_columns: int, *, delimiter: str
) -> Array:
    """Return the numbers of rows (line number, line); empty cells are NaN.

    A line may end early (the rest is empty) or in empty cells beyond the last column.
    """
    if not rows:
        return np.empty((0, n_columns))
    # A damaged header must not allocate more memory than the lines can fill.
    if len(rows) * n_columns > 4 * sum(len(line) for _, line in rows) + 10_000:
        raise FileError(
            f"{path}: expected {n_columns} columns as in its header, but its "
            f"{len(rows)} rows are far shorter, so the file is damaged."
        )
    lines = [_fitted(path, number, line, n_columns, delimiter) for number, line in rows]
    text = "\n" + "\n".join(lines) + "\n"
    # Blanks around a number mean nothing; between two they are a missing delimiter.
    if " " in text:
        text = re.sub(f" *([{delimiter}\n]) *", r"\1", text)
    if "#" in text or "null" in text.lower():
        text = _NOT_A_NUMBER.sub("nan", text)
    # Twice, because neighboring gaps share a delimiter.
    for _ in range(2):
        text = text.replace(2 * delimiter, f"{delimiter}nan{delimiter}")
    text = text.replace(f"\n{delimiter}", f"\nnan{delimiter}")
    text = text.replace(f"{delimiter}\n", f"{delimiter}nan\n")
    try:
        return np.loadtxt(
            text.split("\n")[1:-1], delimiter=delimiter, comments=None, ndmin=2
        )
    except ValueError:
        _refuse_first_non_number(path, rows, delimiter)
        raise FileError(f"{path}: its rows are not all numbers.") from None


def _fitted(path: Path, number: int, line: str, n_columns: int, delimiter: str) -> str:
    surplus = line.count(delimiter) + 1 - n_columns
    if surplus <= 0:
        return line + delimiter * -surplus
    line, *beyond = line.rsplit(delimiter, surplus)
    if any(cell.strip() for cell in beyond):
        raise FileError(
            f"{path}: expected {n_columns} columns as in its header, found "
            f"{n_columns + surplus} in line {number}."
        )
    return line


def _refuse_first_non_number(path: Path, rows: list[Row], delimiter: str) -> None:
    for number, line in rows:
        for cell in line.split(delimiter):
            try:
                float(cell.strip() or "nan")
            except ValueError:
                raise FileError(
                    f"{path}: expected numbers in line {number}, found {shown(cell)}."
                ) from None
