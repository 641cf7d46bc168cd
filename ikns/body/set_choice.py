"""Which marker set fits the labels of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ikns.body.marker_set import MarkerSet, label_keys


def set_worn(choice: str | Path | MarkerSet | None, own: MarkerSet) -> MarkerSet:
    """Return the marker set that is meant; None means the body's own.

    Where that is a shipped one, all of it: a person's body lacks static-only markers.

    >>> clusters = MarkerSet.load("ue_adl")
    >>> set_worn(None, clusters.without_static()) == clusters
    True
    """
    if choice is None:
        return MarkerSet.load(own.name) if own.name in MarkerSet.names() else own
    return choice if isinstance(choice, MarkerSet) else MarkerSet.load(choice)


class SetMatch(NamedTuple):
    """How many markers of a set a recording has; static-only ones do not count."""

    name: str
    found: int
    of: int

    @property
    def share(self) -> float:
        """Share of the set."""
        return self.found / max(self.of, 1)

    def __str__(self) -> str:
        """Say it."""
        count = (
            f"all {self.of}" if self.found == self.of else f"{self.found} of {self.of}"
        )
        return f"{count} markers of {self.name}"


def match_set(worn: MarkerSet, labels: Sequence[str]) -> SetMatch:
    """Count the markers of a set that are among the labels of a recording.

    >>> match_set(MarkerSet.load("oxford24"), ["Ann:RSHO", "c7", "XYZ"]).found
    2
    """
    keys = label_keys(labels)
    tracked = worn.without_static().markers
    found = sum(
        any(name.casefold() in keys for name in (m.label, *m.aliases)) for m in tracked
    )
    return SetMatch(worn.name, found, len(tracked))


def better_set(worn: MarkerSet, labels: Sequence[str]) -> SetMatch | None:
    """Return the shipped set that fits labels best, if better than the one given.

    Better is the set of which more markers, and a larger share, are there. A set of
    one's own may leave markers out on purpose, so that it is enough for it to find half
    of its own.

    >>> pig = ["C7", "T10", "CLAV", "STRN", "RSHO", "RELB", "RWRA", "RWRB", "RFIN"]
    >>> better_set(MarkerSet.load("oxford24"), [*pig, "RBAK"]).name
    'plug_in_gait'
    >>> better_set(MarkerSet.load("plug_in_gait"), pig) is None
    True
    """
    own = match_set(worn, labels)
    if worn.name not in MarkerSet.names() and own.share >= 0.5:
        return None
    best = max(
        (match_set(each, labels) for each in _shipped()),
        key=lambda match: (match.found, match.share),
    )
    better = best.found > own.found and best.share > own.share and best.share >= 0.5
    return best if better else None


@cache
def _shipped() -> tuple[MarkerSet, ...]:
    return tuple(MarkerSet.load(name) for name in MarkerSet.names())


def option(name: str) -> str:
    """Say how a set is given on the command line and in Python."""
    return f'--marker-set {name} (in Python marker_set="{name}")'


def other_set(
    worn: MarkerSet, labels: Sequence[str], *, calibrated: bool
) -> tuple[str, str] | None:
    """Say that another shipped set fits labels better, and what to do; None if not.

    `calibrated` says that the set is that of a person's body, not one to be chosen.
    """
    best = better_set(worn, labels)
    if best is None:
        return None
    right = f"use {option(best.name)}"
    if calibrated:
        right = (
            f"calibrate with {option(best.name)}, or use recordings with markers of "
            f"{worn.name}"
        )
    return f"it has {best}, but only {match_set(worn, labels)}", right


def too_few_of_set(
    source: str, worn: MarkerSet, labels: Sequence[str], *, calibrated: bool = False
) -> str:
    """Say that a recording has too few markers of a set, and which others."""
    if other := other_set(worn, labels, calibrated=calibrated):
        return f"{source}: {other[0]}; {other[1]}."
    there = worn.columns(labels)
    have = [m.label for m, c in zip(worn.markers, there, strict=True) if c >= 0]
    lack = [m.label for m in worn.markers if m.label not in have]
    own = set(there.tolist())
    others = [x.rsplit(":", 1)[-1] for i, x in enumerate(labels) if i not in own]
    right = (
        f"use recordings with markers of {worn.name}"
        if calibrated
        else "give the set that was worn as --marker-set, or make one with "
        "`ikns markers new`"
    )
    return (
        f"{source}: only {len(have)} of {len(worn.markers)} markers of {worn.name} are "
        f"in it{_listed(' (', have, ')')}; missing: {_listed('', lack)}; its other "
        f"labels: {_listed('', others) or 'none'}; {right}."
    )


def _listed(before: str, labels: Sequence[str], after: str = "", most: int = 4) -> str:
    """Return the first few labels; nothing for none."""
    shown = ", ".join([*labels[:most], *(["..."] if len(labels) > most else [])])
    return before + shown + after if labels else ""
