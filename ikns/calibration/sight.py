"""Which marker of a recording is not where it was in the static trial."""

from __future__ import annotations

import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.visibility import say_apart, segment_pairs
from ikns.recording.recording import Recording

__all__ = ["marker_fault"]

#: Most that the distance of two markers of a segment may differ from the static trial,
#: median, m. Real people's differ by 2 to 4 mm, for moments by up to 24
#: (benchmarks/stray_marker.py).
_MOST_CHANGE = 0.02


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
