"""Measures of a recording and its tracking, for verdicts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.exploration import judge_exploration
from ikns.motion.marker_ik.rejection import rejection_sentence
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording

#: Smallest share of frames in which the arm is in sight.
SEEN_SHARE = 0.5


def tracking_fault(
    skeleton: Skeleton, recording: Recording, motion: Motion, *, chain: ChainLike
) -> str:
    """Describe a fault of markers or tracking; empty if there is none.

    A fault of some frames only is none, as these can be left out.
    """
    findings = judge_exploration(
        recording, skeleton.marker_set, skeleton, skeleton=skeleton, chain=chain
    )
    for finding in findings:
        if finding.severity == "refuse" or (
            finding.severity == "warn" and not finding.frames
        ):
            return finding.reason[0].upper() + finding.reason[1:]
    known = np.isfinite(motion.hand_speed(chain))
    if known.mean() >= SEEN_SHARE:
        return ""
    if left_out := rejection_sentence(motion, chain):
        return f"Only {percent(known):.0f} % of the frames can be used: {left_out}."
    return f"The arm was visible in only {percent(known):.0f} % of the frames."


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
