"""Verdicts that rest on ordinary movement: its coverage, and places half explored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import ChainLike, whole_arms
from ikns.body.skeleton import Skeleton
from ikns.calibration.natural import LEAST_COVERED, LEAST_NATURAL
from ikns.errors import IknsError
from ikns.live.calibration.measures import (
    median,
    millimeters,
    missing_percent,
    percent,
    tracking_fault,
)
from ikns.live.calibration.verdict import Verdict
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.motion.reaches import find_reaches
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import readout_samples
from ikns.nullspace.readout.ends import swept_ends
from ikns.nullspace.readout.intent import wrapped
from ikns.recording.recording import Recording

#: Smallest share of the time in which the hand moves.
_MOVING_SHARE = 0.5
#: A place with less than this share of the usual width, and an end more than a tenth of
#: that short of its usual place, was half explored; known from so many places on.
_NARROW, _SHORT, _PLACES = 0.8, 0.1, 3
#: A sweep to both ends takes up to 3 s at a comfortable pace (0.3 to 0.6 Hz): a shorter
#: recording that is narrow says nothing of the place, s.
LEAST_SWEEP = 3.0


def judge_natural(
    recording: Recording,
    skeleton: Skeleton,
    *,
    chain: ChainLike,
    max_hand_speed: float = 0.05,
) -> Verdict:
    """Judge ordinary movement: the hand moves most of the time, and not in one place.

    Parameters
    ----------
    recording : Recording
    skeleton : Skeleton
        The person's.
    chain : str
        See :class:`ikns.Chain`.
    max_hand_speed : float
        Faster hands move, m/s.
    """
    values: dict[str, Any] = {
        "seconds": len(recording.time) / recording.rate,
        "missing_percent": missing_percent(recording, skeleton),
    }
    try:
        motion = MarkerIK(skeleton).track(recording, chain=chain)
    except IknsError as error:
        return Verdict(False, False, str(error), values)
    hand, speed = motion.task_position(chain), motion.hand_speed(chain)
    known = np.isfinite(hand).all(axis=1) & np.isfinite(speed)
    moving = known & (speed >= max_hand_speed)
    spans = np.zeros(3)
    if moving.any():
        spans = np.ptp(np.quantile(hand[moving], [0.01, 0.99], axis=0), axis=0)
    seconds = float(moving.sum() / recording.rate)
    reaches = find_reaches(speed, hand, max_hand_speed=max_hand_speed, min_distance=0.1)
    values |= {
        "hand_seen_percent": percent(known),
        "residual_mm": millimeters(median(motion.residual)),
        "moving_s": round(seconds, 1),
        "reaches": len(reaches),
        "span_cm": np.round(100 * spans, 1).tolist(),
    }
    reason = tracking_fault(skeleton, recording, motion, chain=chain)
    usable = bool(spans.max() >= LEAST_COVERED and seconds >= LEAST_NATURAL)
    if not reason and seconds < max(_MOVING_SHARE * values["seconds"], LEAST_NATURAL):
        reason = (
            f"The hand moved for only {seconds:.0f} s, expected at least half of the "
            "time: reach, carry and put things away without a break."
        )
    elif not reason and np.sort(spans)[1] < LEAST_COVERED:
        reason = (
            f"The hand covered only {' x '.join(f'{100 * s:.0f}' for s in spans)} cm, "
            f"expected {100 * LEAST_COVERED:.0f} cm in at least two directions: "
            "use the whole work space."
        )
    words = reason or "The hand moved over the work space."
    return Verdict(
        not reason, usable, words, values, explored=hand[known], motion=motion
    )


def natural_of(
    motions: list[tuple[Skeleton, Motion]], chain: ChainLike, *, max_hand_speed: float
) -> NaturalPosture:
    """Return the natural posture by what was accepted; without enough, of people."""
    if len(whole_arms(chain)) != 1:
        return NaturalPosture.of_people(hand=True)
    places, swivels, seconds = [], [], 0.0
    for skeleton, motion in motions:
        place, swivel = readout_samples(skeleton, motion, chain, "intent")
        row = np.isfinite(place).all(axis=1) & np.isfinite(swivel[:, 0])
        row &= motion.hand_speed(chain) >= max_hand_speed
        places.append(place[row])
        swivels.append(swivel[row, 0])
        seconds += float(row.sum() * np.median(np.diff(motion.time)))
    if seconds < LEAST_NATURAL:
        return NaturalPosture.of_people(hand=True)
    return NaturalPosture().fit(np.concatenate(places), np.concatenate(swivels))


def ends_beyond(
    skeleton: Skeleton,
    motion: Motion,
    gate: NDArray[np.bool_],
    chain: ChainLike,
    natural: NaturalPosture,
) -> tuple[float, float] | None:
    """Return the ends of s - s_nat while the hand is still, rad; None if unknown."""
    if len(whole_arms(chain)) != 1:
        return None
    place, swivel = readout_samples(skeleton, motion, chain, "intent")
    row = gate & np.isfinite(place).all(axis=1) & np.isfinite(swivel[:, 0])
    if row.sum() < 2:
        return None
    beyond = wrapped(swivel[row, 0] - natural.swivel(place[row]))
    low, high, _ = swept_ends(np.unwrap(beyond), motion.time[row])
    return low, high


def half_explored(
    ends: tuple[float, float], earlier: Mapping[str, tuple[float, float]]
) -> str:
    """Say that a place was half explored, next to earlier ones; empty if not."""
    if len(earlier) < _PLACES:
        return ""
    low, high = np.median(list(earlier.values()), axis=0)
    usual, width = high - low, ends[1] - ends[0]
    short = max(ends[0] - low, high - ends[1])
    if width >= _NARROW * usual or short <= _SHORT * usual:
        return ""
    end = "lower" if ends[0] - low > high - ends[1] else "upper"
    return (
        f"The elbow covered {np.degrees(width):.0f} deg, at other points "
        f"{np.degrees(usual):.0f} deg: move it to the {end} end too, if it gets there."
    )
