"""Markers of a body that a recording does not have."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from ikns.body.chains import ChainLike, chain_sides
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.errors import RecordingWarning, naming
from ikns.recording.recording import Recording


def warn_unseen(
    skeleton: Skeleton, recording: Recording, chain: ChainLike | None = None
) -> tuple[str, ...]:
    """Warn of markers that are in no frame, and return their labels.

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
    own = ("",) if chain is None else ("thorax", *chain_sides(chain))
    lost = unseen_labels(skeleton.marker_set.without_static(), recording, own)
    if lost:
        note = f"{unseen_words(lost)}; the body is tracked by the other markers."
        warnings.warn(RecordingWarning(recording.source, note), stacklevel=2)
    return lost


def unseen_labels(
    worn: MarkerSet, recording: Recording, own: tuple[str, ...] = ("",)
) -> tuple[str, ...]:
    """Return the markers of a set on the links that begin so, and are in no frame."""
    with naming(recording.source):
        markers = worn.pick(recording.labels, recording.markers)
    seen = np.asarray(np.isfinite(markers).all(axis=2).any(axis=0))
    return tuple(
        marker.label
        for marker, shown in zip(worn.markers, seen, strict=True)
        if not shown and marker.link.startswith(own)
    )


def unseen_words(lost: Sequence[str]) -> str:
    """Say that markers are in no frame.

    >>> unseen_words(["RELB"]), unseen_words(["RFIN", "RELB"])
    ('RELB is in no frame', 'RFIN, RELB are in no frame')
    """
    return f"{', '.join(lost)} {'is' if len(lost) == 1 else 'are'} in no frame"
