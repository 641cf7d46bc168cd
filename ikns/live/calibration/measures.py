"""What verdicts measure on a recording and its tracking."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.body.skeleton import Skeleton
from ikns.calibration import marker_fault
from ikns.motion.motion import Motion
from ikns.numerics.rigid import rigid_transform
from ikns.recording.recording import Recording

__all__ = [
    "median",
    "millimeters",
    "missing_percent",
    "percent",
    "stray",
    "tracking_fault",
]

Array = NDArray[np.float64]

#: Most distance between markers and body, median, m: half of where tracking counts as
#: lost. Soft tissue and modeling leave 10 to 20 mm.
MOST_RESIDUAL = 0.03
#: Share of frames that must show the arm.
SEEN_SHARE = 0.5


def tracking_fault(
    skeleton: Skeleton,
    recording: Recording,
    motion: Motion,
    known: NDArray[np.bool_],
    *,
    chain: str,
) -> str:
    """Say what is wrong with markers or tracking; empty where nothing is."""
    if known.mean() < SEEN_SHARE:
        return f"The arm was in sight in {percent(known):.0f} % of the frames only."
    if fault := marker_fault(skeleton, recording, chain):
        return fault
    residual = median(motion.residual)
    if residual > MOST_RESIDUAL:
        return (
            f"Markers and body do not fit, {millimeters(residual):.0f} mm apart: a "
            "marker moved or carries another's name."
        )
    return ""


def stray(markers: Array) -> Array:
    """Root mean square stray of each marker, sway of the body taken out, (M,) m."""
    seen = np.all(np.isfinite(markers), axis=2)
    middle = np.full(markers.shape[1:], np.nan)
    some = seen.any(axis=0)
    middle[some] = np.nanmean(markers[:, some], axis=0)
    strays = np.full(seen.shape, np.nan)
    for i, frame in enumerate(markers):
        if seen[i].sum() >= 3:
            own = seen[i]
            rotation, shift = rigid_transform(frame[own], middle[own])
            moved = frame[own] @ rotation.T + shift - middle[own]
            strays[i, own] = np.linalg.norm(moved, axis=1)
    stray = np.zeros(seen.shape[1])
    measured = np.isfinite(strays).any(axis=0)
    stray[measured] = np.sqrt(np.nanmean(strays[:, measured] ** 2, axis=0))
    return stray


def missing_percent(recording: Recording, skeleton: Skeleton) -> float:
    """Share of the markers of the set that were not seen, %."""
    worn = skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)
    return percent(~np.isfinite(markers).all(axis=2))


def median(values: Array) -> float:
    """Middle of the finite values; infinite without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.inf


def percent(share: Any) -> float:
    """Share of what is true, %, to one decimal."""
    return round(100 * float(np.mean(share)), 1)


def millimeters(value: float) -> float:
    """From m, to one decimal."""
    return round(1e3 * float(value), 1)
