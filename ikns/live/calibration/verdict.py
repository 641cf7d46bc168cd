"""Verdicts on recordings, before the person leaves the cameras.

The limits are named constants with their origin; none is from the paper. A verdict
recommends, the experimenter decides. Points are judged in a file of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration import scaling
from ikns.calibration.judge.finding import refused
from ikns.calibration.judge.static import marker_displacement
from ikns.errors import IknsError
from ikns.live.calibration.measures import (
    SEEN_SHARE,
    median,
    millimeters,
    missing_percent,
    percent,
    tracking_fault,
)
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import minimum_bounding_box
from ikns.recording.recording import Recording

#: A hand that moves farther than this is not at one position, and two points closer
#: than this are not two positions, m (a fifth of a small workspace; chosen here).
ONE_PLACE = 0.05
#: Smallest side of the explored box, m: a thinner one has no two layers of points.
LEAST_BOX = 2 * ONE_PLACE


@dataclass(frozen=True, eq=False)
class Verdict:
    """Result of judging a recording.

    Parameters
    ----------
    keep : bool
        The recommendation.
    usable : bool
        Whether a calibration can use it at all.
    reason : str
        One sentence.
    values : dict
        The numbers behind it, ready for JSON, with units in their names.
    place : (3,) array, optional
        Where the hand was held, thorax frame, m.
    explored : (N, 3) array, optional
        Where the hand went, thorax frame, m.
    skeleton : Skeleton, optional
        The person's, from the static trial.
    motion : Motion, optional
        Movement that shows the natural posture.
    ends : (float, float), optional
        Of s - s_nat at a held point, rad.
    """

    keep: bool
    usable: bool
    reason: str
    values: dict[str, Any]
    place: Array | None = field(default=None, repr=False)
    explored: Array | None = field(default=None, repr=False)
    skeleton: Skeleton | None = field(default=None, repr=False)
    motion: Motion | None = field(default=None, repr=False)
    ends: tuple[float, float] | None = None


def judge_static(
    recording: Recording,
    generic: Skeleton,
    *,
    marker_set: str,
    min_static: float = 1.0,
) -> Verdict:
    """Judge the static trial: markers in sight, still, and enough to scale a body.

    Parameters
    ----------
    recording : Recording
    generic : Skeleton
        Body to scale.
    marker_set : str
        Name of the marker set of the person.
    min_static : float
        Shortest duration to accept, s.
    """
    expected = MarkerSet.load(marker_set)
    markers = expected.pick(recording.labels, recording.markers)
    seen = np.all(np.isfinite(markers), axis=2)
    never = [m for m, s in zip(expected.labels, seen.any(axis=0), strict=True) if not s]
    values: dict[str, Any] = {
        "seconds": len(recording.time) / recording.rate,
        "markers_seen": len(expected.labels) - len(never),
        "markers_expected": len(expected.labels),
        "markers_never_seen": never,
        "missing_percent": percent(~seen),
        "spread_mm": millimeters(marker_displacement(markers).max(initial=0.0)),
    }
    try:
        judged = scaling.judge_static(
            generic, recording, marker_set=marker_set, min_duration=min_static
        )
    except IknsError as error:
        return Verdict(False, False, str(error), values)
    values["findings"] = [finding.as_dict() for finding in judged.findings]
    faults = [f for f in judged.findings if f.severity != "note"]
    reason = faults[0].reason if faults else ""
    if judged.report is None or refused(faults):
        return Verdict(False, False, _sentence(reason), values)
    values["residual_mm"] = millimeters(max(judged.report.residuals.values()))
    dropped = judged.report.dropped
    if not reason and (
        lost := _lost(expected, seen.any(axis=0), recording.labels, dropped)
    ):
        reason = (
            f"Never visible: {', '.join(lost)}; markers missing from the static "
            "trial cannot be used later."
        )
    elif not reason and np.mean(seen[:, seen.any(axis=0)]) < SEEN_SHARE:
        reason = f"{values['missing_percent']:.0f} % of the markers were missing."
    words = _sentence(reason or "The person stood still.")
    return Verdict(not reason, True, words, values, skeleton=judged.skeleton)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


def _lost(
    expected: MarkerSet,
    seen: NDArray[np.bool_],
    labels: Sequence[str],
    dropped: Sequence[str],
) -> list[str]:
    """Name markers that the calibration leaves out though the person may wear them.

    They are of segments with other markers in sight, and their labels are recorded.
    """
    shown = {m.link for m, s in zip(expected.markers, seen, strict=True) if s}
    return [
        m.label
        for m, s in zip(expected.markers, seen, strict=True)
        if not (s or m.static_only)
        and m.link in shown
        and m.label in dropped
        and {m.label, *m.aliases} & set(labels)
    ]


def judge_free(
    recording: Recording, skeleton: Skeleton, *, chain: ChainLike
) -> Verdict:
    """Judge the free exploration, which only shows where the hand can go.

    Parameters
    ----------
    recording : Recording
    skeleton : Skeleton
        The person's.
    chain : str
        See :class:`ikns.Chain`.
    """
    values: dict[str, Any] = {
        "seconds": len(recording.time) / recording.rate,
        "missing_percent": missing_percent(recording, skeleton),
    }
    try:
        motion = MarkerIK(skeleton).track(recording, chain=chain)
    except IknsError as error:
        return Verdict(False, False, str(error), values)
    places = motion.task_position(chain)
    known = np.all(np.isfinite(places), axis=1)
    explored = places[known]
    values["hand_seen_percent"] = percent(known)
    values["residual_mm"] = millimeters(median(motion.residual))
    if len(explored) < 4:
        reason = tracking_fault(skeleton, recording, motion, chain=chain)
        return Verdict(
            False, False, reason or "The hand was hardly ever visible.", values
        )
    box = minimum_bounding_box(explored)
    values["box_cm"] = np.round(200 * box.half_lengths, 1).tolist()
    reason = tracking_fault(skeleton, recording, motion, chain=chain)
    if not reason and 2 * box.half_lengths.min() < LEAST_BOX:
        reason = (
            f"The hand explored a volume only {200 * box.half_lengths.min():.0f} cm "
            f"thick, expected at least {100 * LEAST_BOX:.0f} cm."
        )
    words = reason or "The hand explored a volume."
    return Verdict(not reason, True, words, values, explored=explored, motion=motion)
