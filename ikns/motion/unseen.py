"""Markers of a body that a recording does not have."""

from __future__ import annotations

import warnings

import numpy as np

from ikns.body.chains import ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import RecordingWarning, naming
from ikns.recording.recording import Recording


def warn_unseen(
    skeleton: Skeleton, recording: Recording, chain: ChainLike | None = None
) -> tuple[str, ...]:
    """Warn of markers that no frame shows, and return their labels.

    Parameters
    ----------
    skeleton : Skeleton
        Its tracked markers are expected; static-only ones are not.
    recording : Recording
    chain : str, optional
        Expect only markers of its arms and of the thorax.

    Warns
    -----
    RecordingWarning
        One, with all of them.
    """
    worn = skeleton.marker_set
    own = ("",) if chain is None else ("thorax", *chain_sides(chain))
    with naming(recording.source):
        markers = worn.pick(recording.labels, recording.markers)
    seen = np.asarray(np.isfinite(markers).all(axis=2).any(axis=0))
    lost = tuple(
        marker.label
        for marker, shown in zip(worn.markers, seen, strict=True)
        if not shown and not marker.static_only and marker.link.startswith(own)
    )
    if lost:
        note = f"no frame shows {', '.join(lost)}, so the others locate the body alone."
        warnings.warn(RecordingWarning(recording.source, note), stacklevel=2)
    return lost
