"""Which columns of a TRC file a label names."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ikns.errors import FileError
from ikns.recording.files.conversion import shown

#: Columns before the first marker: frame number and time.
_BEFORE = 2
_FRAME = re.compile(r"(frame|field)s?\s*(#|no\.?|number)?", re.IGNORECASE)
#: ``Time``, ``Time (s)``, and ``Time RSHO`` where a tab between the two is missing.
_TIME = re.compile(r"times?\s*(?:[(\[].*)?(?:\s(?P<label>[^(\[].*))?", re.IGNORECASE)
#: A label of one coordinate, ``nose_x``.
_COORDINATE = re.compile(r"(.+?)[ _.:-]?([xyz])", re.IGNORECASE)


def place_labels(
    path: Path, line: str, width: int, said: float, notes: list[str]
) -> list[str]:
    """Return the label of every marker, in the order of the columns.

    Labels above their X have their place by position; otherwise there must be one for
    every three columns.

    Parameters
    ----------
    path : Path
        For messages.
    line : str
        The line of labels.
    width : int
        Cells that a row of numbers has, frame and time among them.
    said : float
        Number of markers in the header.
    notes : list of str
        Gets a sentence for everything that was repaired.

    Returns
    -------
    list of str
        Empty for a marker without a label.
    """
    found = _labels(line)
    n_columns = -(-(width - _BEFORE) // 3)
    names = [label for _, label in found]
    places = [at for at, _ in found]
    aligned = len(set(places)) == len(places) and all(
        at >= _BEFORE and (at - _BEFORE) % 3 == 0 for at in places
    )
    if aligned:
        last = max((at for at, _ in found), default=_BEFORE - 3)
        n = max(n_columns, (last - _BEFORE) // 3 + 1)
        by_place = {(at - _BEFORE) // 3: label for at, label in found}
        labels = [by_place.get(marker, "") for marker in range(n)]
    elif len(found) == n_columns or len(found) == said:
        labels = names
        notes.append("its labels are not above their X and are taken in order.")
    elif len(found) == 3 * n_columns:
        labels = _of_coordinates(path, names)
    else:
        raise FileError(
            f"{path}: expected every marker label above its X, followed by two empty "
            f"cells for Y and Z, found {len(found)} labels for {n_columns} markers in "
            f"{shown(line)}."
        )
    surplus = sum(not label for label in labels) + max(n_columns - len(labels), 0)
    if surplus:
        notes.append(f"{3 * surplus} of its columns have no label and are left out.")
    # Some writers count the columns without a label, others do not.
    right = (len(labels), len(found), len(labels) + surplus)
    if not math.isnan(said) and said not in right:
        notes.append(f"its header says {said:g} markers, found {len(found)} labels.")
    return labels


def _labels(line: str) -> list[tuple[int, str]]:
    """Return the labels of a line and the cells where they stand.

    Two in one cell, with blanks in between, stood in cells of their own before an
    editor aligned them.
    """
    cells = line.split("\t") if "\t" in line else line.split()
    found = [
        (at, label)
        for at, cell in enumerate(cells)
        for label in re.split(r"\s{2,}", cell.strip())
        if label
    ]
    if found and _FRAME.fullmatch(found[0][1]):
        del found[0]
    if found and (time := _TIME.fullmatch(found[0][1])):
        at, _ = found.pop(0)
        if time["label"]:
            found.insert(0, (at, time["label"].strip()))
    return found


def _of_coordinates(path: Path, names: list[str]) -> list[str]:
    """Return one label for three that name the coordinates of a marker."""
    labels = []
    for three in zip(names[::3], names[1::3], names[2::3], strict=True):
        parts = [_COORDINATE.fullmatch(name) for name in three]
        if len(set(three)) == 1:
            labels.append(three[0])
        elif all(parts) and [part[2].lower() for part in parts if part] == [*"xyz"]:
            stems = {part[1] for part in parts if part}
            labels.append(stems.pop() if len(stems) == 1 else "")
        else:
            labels.append("")
        if not labels[-1]:
            raise FileError(
                f"{path}: expected the labels of X, Y and Z of one marker next to each "
                f"other, found {shown(' '.join(three))}."
            )
    return labels
