"""Which frames show the segments that a chain is made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.errors import MarkerMismatch
from ikns.motion import chain_sides
from ikns.recording import Recording
from ikns.skeleton import Skeleton

__all__ = ["check_segments", "in_sight"]


def in_sight(
    skeleton: Skeleton, recording: Recording, chain: str
) -> dict[str, NDArray[np.bool_]]:
    """Say in which frames each segment of a chain, and the thorax, shows a marker.

    Returns
    -------
    dict of (T,) boolean array
        By link; only links that carry markers.
    """
    worn = skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)
    seen = np.all(np.isfinite(markers), axis=2)
    rows: dict[str, list[int]] = {}
    for column, marker in enumerate(worn.markers):
        if marker.link.startswith(("thorax", *chain_sides(chain))):
            rows.setdefault(marker.link, []).append(column)
    return {link: np.any(seen[:, own], axis=1) for link, own in rows.items()}


def check_segments(skeleton: Skeleton, recording: Recording, chain: str) -> None:
    """Refuse a recording in which a segment of the chain is never seen.

    Raises
    ------
    MarkerMismatch
        With the segment and the markers that would show it.
    """
    worn = skeleton.marker_set
    if (worn.columns(recording.labels) < 0).all():
        return  # marker inverse kinematics says so better
    for link, frames in in_sight(skeleton, recording, chain).items():
        if not frames.any():
            wanted = [marker.label for marker in worn.markers if marker.link == link]
            raise MarkerMismatch(
                f"{recording.source}: the segment {link} has no marker; expected at "
                f"least one of {', '.join(wanted)} of {worn.name}."
            )
