"""Whether the labels of a recording are those of the marker set."""

from __future__ import annotations

from collections.abc import Sequence

from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import better_set, match_set
from ikns.calibration.judge.finding import Finding

#: With less than this share of a set it is another one.
_ANOTHER = 0.5


def judge_labels(
    where: str, labels: Sequence[str], worn: MarkerSet, *, calibrated: bool
) -> list[Finding]:
    """Say that another shipped set fits the labels of a recording better.

    `calibrated` says that the set is that of a person's body, not one to be chosen.
    """
    best = better_set(worn, labels)
    if best is None:
        return []
    own = match_set(worn, labels)
    return [
        Finding(
            "marker set",
            "refuse" if own.share < _ANOTHER else "warn",
            where,
            f"it has {best}, but {own}",
            f"calibrate with --marker-set {best.name}, or use recordings with "
            f"markers of {worn.name}"
            if calibrated
            else f"use --marker-set {best.name}",
        )
    ]
