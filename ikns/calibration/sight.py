"""Which frames show the segments that a chain is made of, and tracking that knows it.

Marker inverse kinematics leaves a joint that no marker shows where it was. That would
pass for a hand held still, so there the hand counts as unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.errors import MarkerMismatch, NotEnoughData, naming
from ikns.marker_ik import MarkerIK
from ikns.motion import Motion, chain_sides
from ikns.recording import Recording
from ikns.skeleton import Skeleton

__all__ = ["in_sight", "sight_needs", "track_chain"]

#: Markers that fix the thorax, to which all else is relative. A limb needs fewer: its
#: joints tie it to the thorax.
_FIX = 3


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
