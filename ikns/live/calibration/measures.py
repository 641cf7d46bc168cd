"""Measures of a recording and its tracking, for verdicts."""

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

Array = NDArray[np.float64]

#: Largest median distance between markers and body, m: half of the limit above which
#: tracking counts as lost. Soft tissue and modeling errors cause 10 to 20 mm.
MOST_RESIDUAL = 0.03
#: Smallest share of frames in which the arm is in sight.
SEEN_SHARE = 0.5


def tracking_fault(
    skeleton: Skeleton,
    recording: Recording,
    motion: Motion,
    known: NDArray[np.bool_],
    *,
    chain: str,
) -> str:
    """Describe a fault of markers or tracking; empty if there is none."""
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


def marker_displacement(markers: Array) -> Array:
    """Root mean square displacement of each marker without body sway, (M,) m."""
    seen = np.all(np.isfinite(markers), axis=2)
    middle = np.full(markers.shape[1:], np.nan)
    some = seen.any(axis=0)
    middle[some] = np.nanmean(markers[:, some], axis=0)
    distances = np.full(seen.shape, np.nan)
    for i, frame in enumerate(markers):
        if seen[i].sum() >= 3:
            own = seen[i]
            rotation, shift = rigid_transform(frame[own], middle[own])
            moved = frame[own] @ rotation.T + shift - middle[own]
            distances[i, own] = np.linalg.norm(moved, axis=1)
    rms = np.zeros(seen.shape[1])
    measured = np.isfinite(distances).any(axis=0)
    rms[measured] = np.sqrt(np.nanmean(distances[:, measured] ** 2, axis=0))
    return rms


def missing_percent(recording: Recording, skeleton: Skeleton) -> float:
    """Share of markers of the set that were not seen, %."""
    marker_set = skeleton.marker_set
    markers = marker_set.pick(recording.labels, recording.markers)
    return percent(~np.isfinite(markers).all(axis=2))


def median(values: Array) -> float:
    """Median of the finite values; infinite without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.inf


def percent(share: Any) -> float:
    """Share of true values, %, to one decimal."""
    return round(100 * float(np.mean(share)), 1)


def millimeters(value: float) -> float:
    """Convert m to mm, to one decimal."""
    return round(1e3 * float(value), 1)
