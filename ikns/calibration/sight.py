"""Which frames show the segments that a chain is made of, and tracking that knows it.

Marker inverse kinematics leaves a joint that no marker shows where it was. That would
pass for a hand held still, so there the hand counts as unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.errors import MarkerMismatch, NotEnoughData, naming
from ikns.marker_ik import MarkerIK
from ikns.motion import Motion, chain_sides
from ikns.recording import Recording
from ikns.skeleton import Skeleton

__all__ = [
    "in_sight",
    "marker_fault",
    "say_apart",
    "segment_pairs",
    "sight_needs",
    "track_chain",
]

#: Markers that fix the thorax, to which all else is relative. A limb needs fewer: its
#: joints tie it to the thorax.
_FIX = 3
#: Most that the distance of two markers of a segment may differ from the static trial,
#: median, m. Real people's differ by 2 to 4 mm, for moments by up to 24
#: (benchmarks/stray_marker.py).
_MOST_CHANGE = 0.02


def track_chain(
    skeleton: Skeleton,
    recording: Recording,
    chain: str,
    *,
    progress: Callable[[str, int, int], None] | None = None,
) -> Motion:
    """Track a recording; the hands are NaN while the chain is not in sight.

    Parameters
    ----------
    skeleton : Skeleton
    recording : Recording
    chain : str
        See :data:`ikns.motion.CHAINS`.
    progress : callable, optional
        Called with (name of the recording, frames done, frames in all).

    Returns
    -------
    Motion

    Raises
    ------
    MarkerMismatch
        When a segment of the chain, or the thorax, is never in sight.
    NotEnoughData
        When there are fewer than two frames.
    """
    if len(recording.time) < 2:
        raise NotEnoughData(
            f"{recording.source}: expected at least 2 frames, as one shows no speed, "
            f"found {len(recording.time)}."
        )
    with naming(recording.source):
        shown = in_sight(skeleton, recording, chain)
    step = Path(recording.source).name
    motion = MarkerIK(skeleton).track(
        recording, progress=None if progress is None else partial(progress, step)
    )
    known = np.all(list(shown.values()), axis=0)[:, None, None]
    return replace(
        motion,
        hand_in_thorax=np.where(known, motion.hand_in_thorax, np.nan),
        hand_velocity_in_thorax=np.where(known, motion.hand_velocity_in_thorax, np.nan),
    )


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


def marker_fault(skeleton: Skeleton, recording: Recording, chain: str) -> str:
    """Say which marker of a chain is not where it was; empty where none is.

    Told by the distances within segments, their median over the recording.
    """
    markers = skeleton.marker_set.pick(recording.labels, recording.markers)
    pairs, worn = segment_pairs(skeleton, chain)
    first, second = np.moveaxis(markers[:, pairs], 2, 0)
    apart = np.linalg.norm(first - second, axis=2)
    change = np.zeros(len(pairs))
    seen = np.isfinite(apart).any(axis=0)
    change[seen] = np.nanmedian(apart[:, seen], axis=0) - worn[seen]
    if not (np.abs(change) > _MOST_CHANGE).any():
        return ""
    k = int(np.abs(change).argmax())
    return (
        f"{say_apart(skeleton, pairs[k], change[k])} than in the static trial: a "
        "marker moved or carries another's name."
    )


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
