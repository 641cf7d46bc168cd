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

from ikns.body.skeleton import Skeleton
from ikns.errors import NotEnoughData, naming
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.visibility import in_sight, say_apart, segment_pairs
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording

__all__ = ["marker_fault", "track_chain"]

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
        See :data:`ikns.body.chains.CHAINS`.
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
