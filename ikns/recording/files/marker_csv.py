"""CSV files of markers: the header says whose export one is."""

from __future__ import annotations

from pathlib import Path

from ikns.recording.files import motive_csv, vicon_workstation
from ikns.recording.files.motive_csv import read_motive_csv
from ikns.recording.files.table import text_lines
from ikns.recording.files.vicon_csv import read_vicon_csv
from ikns.recording.files.vicon_workstation import read_vicon_workstation
from ikns.recording.recording import Recording

#: Lines that are looked at to see what stands between the cells.
_HEAD = 20


def read_marker_csv(path: Path) -> Recording:
    """Read a CSV export of Vicon Nexus, Vicon Workstation or OptiTrack Motive."""
    lines = _comma_separated(text_lines(path))
    if lines[0].strip('" ').startswith(motive_csv.FIRST_WORDS):
        return read_motive_csv(path, lines)
    if any(line.strip(" ,\t") == vicon_workstation.TITLE for line in lines):
        return read_vicon_workstation(path, lines)
    return read_vicon_csv(path, lines)


def _comma_separated(lines: list[str]) -> list[str]:
    """Return lines with commas between the cells, and points in the numbers.

    Where numbers have decimal commas, programs put semicolons or tabs between them.
    """
    head = "\n".join(lines[:_HEAD])
    for separator in (";", "\t"):
        if head.count(separator) > head.count(","):
            return [line.replace(",", ".").replace(separator, ",") for line in lines]
    return lines
