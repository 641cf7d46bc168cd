"""Which frames show the segments that a chain is made of."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import MarkerMismatch
from ikns.recording.recording import Recording

__all__ = ["in_sight", "say_apart", "segment_pairs", "sight_needs"]

#: Markers that fix the thorax, to which all else is relative. A limb needs fewer: its
#: joints tie it to the thorax.
_FIX = 3


def sight_needs(skeleton: Skeleton, chain: str) -> dict[str, tuple[list[int], int]]:
    """By link of a chain, and the thorax: its markers, and how many must be seen."""
    columns: dict[str, list[int]] = {}
    for column, marker in enumerate(skeleton.marker_set.markers):
        if marker.link.startswith(("thorax", *chain_sides(chain))):
            columns.setdefault(marker.link, []).append(column)
    return {
        link: (own, min(_FIX, len(own)) if link == "thorax" else 1)
        for link, own in columns.items()
    }


def segment_pairs(
    skeleton: Skeleton, chain: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Markers of the same segment of a chain, or of the thorax, two and two.

    Segments hardly stretch: where a distance differs, a marker has moved, or is taken
    for another.

    Returns
    -------
    pairs : (N, 2) integer array
        Columns of the skeleton's marker set.
    apart : (N,) array
        How far apart they are on the person, m.
    """
    needs = sight_needs(skeleton, chain).values()
    found = [pair for columns, _ in needs for pair in combinations(columns, 2)]
    pairs = np.array(found, dtype=np.int64).reshape(-1, 2)
    # On one link, so these are its own coordinates.
    first, second = skeleton.marker_positions[pairs.T]
    return pairs, np.linalg.norm(first - second, axis=1)


def say_apart(skeleton: Skeleton, pair: NDArray[np.int64], change: float) -> str:
    """Say that two markers are nearer or farther than on the person, by so many m."""
    first, second = (skeleton.marker_set.labels[column] for column in pair)
    side = "farther apart" if change > 0 else "closer"
    return f"{first} and {second} are {abs(1000 * change):.0f} mm {side}"


def in_sight(
    skeleton: Skeleton, recording: Recording, chain: str
) -> dict[str, NDArray[np.bool_]]:
    """Say in which frames each segment of a chain, and the thorax, is in sight.

    A limb is with one marker, the thorax with three, or all of a set that has fewer.

    Returns
    -------
    dict of (T,) boolean array
        By link, of those that carry markers.

    Raises
    ------
    MarkerMismatch
        When a segment never is; with the markers that would show it.
    """
    worn = skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)
    seen = np.all(np.isfinite(markers), axis=2)
    shown = {}
    for link, (own, need) in sight_needs(skeleton, chain).items():
        shown[link] = np.count_nonzero(seen[:, own], axis=1) >= need
        if not shown[link].any():
            raise MarkerMismatch(
                f"{recording.source}: the segment {link} is never in sight; expected "
                f"at least {need} of {', '.join(worn.labels[i] for i in own)} of "
                f"{worn.name} in a frame."
            )
    return shown
