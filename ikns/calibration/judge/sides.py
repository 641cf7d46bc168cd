"""Left and right: markers that carry the other side's name, and mirror images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Indices
from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.finding import Finding


def other_side(labels: Sequence[str]) -> Indices:
    """Find each marker's namesake on the other side; itself where there is none.

    >>> other_side(["C7", "RSHO", "LSHO", "RMEP"]).tolist()
    [0, 2, 1, 3]
    """
    swap = {"R": "L", "L": "R"}
    names = [swap.get(label[:1], "") + label[1:] for label in labels]
    return np.array(
        [labels.index(name) if name in labels else i for i, name in enumerate(names)]
    )


#: How labels of all markers of a file are changed.
_SIDES = "in a file: `ikns convert --labels FILE` with a line OLD=NEW for each marker"


def labels_in_file(worn: MarkerSet, labels: Sequence[str]) -> tuple[str, ...]:
    """Return how a file with these labels names each marker, without a subject.

    >>> worn = MarkerSet.load("oxford24")
    >>> labels_in_file(worn, ["Ann:RACR"])[worn.labels.index("RSHO")]
    'RACR'
    """
    columns = worn.columns(labels).tolist()
    return tuple(
        own if c < 0 else labels[c].rsplit(":", 1)[-1]
        for own, c in zip(worn.labels, columns, strict=True)
    )


def renaming(labels: Sequence[str], exchanges: Sequence[tuple[int, int]]) -> str:
    """Say how exchanges of markers, one after the other, are made in a file.

    >>> renaming(["A", "B", "C"], [(0, 1)])
    'in a file: `ikns convert --rename B=A --rename A=B`'
    """
    own = list(range(len(labels)))
    for a, b in exchanges:
        own[a], own[b] = own[b], own[a]
    options = [f"--rename {labels[k]}={labels[i]}" for i, k in enumerate(own) if i != k]
    return f"in a file: `ikns convert {' '.join(options)}`"


def sides_exchanged(where: str, then: str) -> Finding:
    """Say that left and right carry each other's names; `then` is what fits then."""
    return Finding(
        "exchanged",
        "refuse",
        where,
        "left and right are swapped",
        f"swap the labels of left and right: {then} ({_SIDES})",
    )


def mirror_image(where: str, then: str, *, or_sides: bool = False) -> Finding:
    """Say that a recording is mirrored; `then` is what fits when it is not.

    Or that left and right may carry each other's names.
    """
    labels = "swap the labels of left and right, or " * or_sides
    return Finding(
        "mirrored",
        "refuse",
        where,
        "the body is a mirror image",
        f"{labels}export without mirroring an axis: {then}" + f" ({_SIDES})" * or_sides,
    )
