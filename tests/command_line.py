"""Run the command line inside a test, and check how it refuses."""

import csv
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ikns.cli import main


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def stamps(folder: Path) -> dict[str, tuple[int, int, int]]:
    """When each file was written, to the nanosecond: the same anew shows, too."""
    return {
        entry.path: (stat.st_mtime_ns, stat.st_size, stat.st_ino)
        for entry in _files(folder)
        for stat in [entry.stat()]
    }


def _files(folder: Path | str) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir():
                yield from _files(entry.path)
            else:
                yield entry


def calibrate(static: Path, *rest: Path | str, out: Path) -> list[str]:
    argv = ["calibrate", "--static", str(static), "--exploration", *map(str, rest)]
    return [*argv, "--out", str(out)]


def check_refused(
    argv: list[str],
    folder: Path,
    capfd: pytest.CaptureFixture[str],
    *,
    names: Path | None = None,
) -> str:
    """Run a command that must fail; every file stays as it was."""
    before = stamps(folder)
    capfd.readouterr()
    assert main(argv) == 2
    sentence = one_sentence(capfd.readouterr())
    assert stamps(folder) == before
    assert names is None or str(names) in sentence
    return sentence


def one_sentence(captured: tuple[str, str]) -> str:
    out, err = captured
    assert out == ""
    assert err.startswith("ikns: ")
    assert err.count("\n") == 1
    assert re.search(r"[.?]\n$", err)
    assert not re.search(r"\. [A-Z]", err)
    return err


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Columns by name; an empty cell is NaN."""
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    return dict(zip(header, table.T, strict=True))
