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


def set_advice(worn: MarkerSet, labels: Sequence[str]) -> str:
    """Say which set to choose instead of one that does not fit."""
    best = better_set(worn, labels)
    if best is not None:
        fit = f"{best.found} of {best.of} fit"
        return f"use {option(best.name)}, of which {fit}"
    return (
        "choose the set that was worn with --marker-set, or describe it with "
        "`ikns markers new`"
    )
