"""Verdict on the recording of a point: hand still, elbow moving, at a new position."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from ikns.analysis.compare.leak import slopes
from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration import elbow_reference, two_arms_fault
from ikns.calibration.natural import LEAST_BENT, elbow_degrees
from ikns.errors import IknsError
from ikns.live.calibration.measures import (
    median,
    millimeters,
    missing_percent,
    tracking_fault,
)
from ikns.live.calibration.natural_verdict import (
    LEAST_SWEEP,
    ends_beyond,
    half_explored,
)
from ikns.live.calibration.verdict import ONE_PLACE, Verdict
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.map import MapWarning, NullSpaceMap, still_mask
from ikns.nullspace.map.samples import samples_in
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.recording.recording import Recording

#: Smallest share of samples with the hand still. A virtual person who holds the hand,
#: with soft tissue artifacts, has 0.47 at the worst of ten points; a quarter of 5 s is
#: more than twice what a point needs.
STEADY_SHARE = 0.25
#: Smallest motion along Z, rad: with a noise of about 0.5 deg per joint angle, c would
#: otherwise have a noise of more than 5 %.
LEAST_RANGE = math.radians(10.0)


def judge_point(
    recording: Recording,
    skeleton: Skeleton,
    *,
    chain: ChainLike,
    n_dof: int = 1,
    variance: float = 0.8,
    max_hand_speed: float = 0.05,
    min_still: float = 0.5,
    min_rest: float = 0.0,
    earlier: Mapping[str, Array] | None = None,
    natural: NaturalPosture | None = None,
    earlier_ends: Mapping[str, tuple[float, float]] | None = None,
) -> Verdict:
    """Judge a point: hand still, elbow moving, one degree of freedom, new position.

    Directions and ranges come from a map of this single point, computed as in the
    calibration.

    Parameters
    ----------
    recording : Recording
    skeleton : Skeleton
        The person's.
    chain : str
        See :class:`ikns.Chain`.
    n_dof, variance, max_hand_speed, min_still, min_rest
        See :func:`ikns.calibrate`.
    earlier : mapping of str to (3,) array
        Points accepted so far, thorax frame, m.
    natural : NaturalPosture, optional
        The person's so far; then a point that was half explored is asked for again.
    earlier_ends : mapping of str to (float, float)
        Ends of the swivel beyond it at points accepted so far, rad.
    """
    values: dict[str, Any] = {
        "seconds": len(recording.time) / recording.rate,
        "missing_percent": missing_percent(recording, skeleton),
    }
    try:
        motion = MarkerIK(skeleton).track(recording, chain=chain)
    except IknsError as error:
        return Verdict(False, False, str(error), values)
    gate = still_mask(
        motion, chain, max_hand_speed=max_hand_speed, min_duration=min_rest
    )
    known = np.isfinite(motion.hand_speed(chain))
    steady = gate.sum() / max(1, known.sum())
    values |= {
        "still_percent": 100 * float(steady),
        "samples": int(gate.sum()),
        "residual_mm": millimeters(median(motion.residual)),
    }
    # As in the calibration, which leaves points with fewer samples out.
    enough = max(samples_in(min_still, recording.rate), len(chain_joints(chain)) + 1)
    reason = tracking_fault(skeleton, recording, motion, chain=chain)
    if gate.sum() < enough:
        speed = median(motion.hand_speed(chain))
        return Verdict(
            False,
            False,
            reason
            or f"The hand was not steady: {gate.sum()} samples below "
            f"{max_hand_speed:g} m/s of the {enough} needed, its median speed "
            f"{speed:.2f} m/s.",
            values,
        )
    x, q = motion.task_position(chain)[gate], motion.chain_angles(chain)[gate]
    place = x.mean(axis=0)
    learned = NullSpaceMap(
        1,
        n_dof=n_dof,
        variance=variance,
        reference=elbow_reference(
            skeleton, motion.angles[gate].mean(axis=0), chain, n_dof=n_dof
        ),
        min_samples=1,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        learned.fit(x, q)
    width = (learned.upper_ - learned.lower_)[0]
    c = np.reshape(learned.control_signal(q, x), (len(q), n_dof))
    known_c = bool(np.isfinite(c).all())  # false if no joint moves at all
    leak = np.linalg.norm(slopes(c, x), axis=1) if known_c else np.full(n_dof, np.nan)
    components = int(learned.n_components_[0])
    values |= {
        "components": components,
        "range_deg": np.degrees(width).round(1).tolist(),
        "leak_mm_per_c": np.round(1e3 * leak, 1).tolist(),
    }
    apart = {
        name: float(np.linalg.norm(place - p)) for name, p in (earlier or {}).items()
    }
    near = min(apart, key=lambda name: apart[name]) if apart else ""
    values["nearest"] = near or None
    values["nearest_cm"] = 100 * apart[near] if near else None
    reason = reason or _fault(
        float(steady), components, n_dof, float(width.min()), float(leak.max()), apart
    )
    values["elbow_deg"] = round(elbow_degrees(motion, gate, chain), 1)
    reason = reason or _straight(values["elbow_deg"])
    ends = None
    if natural is not None and n_dof == 1:
        ends = ends_beyond(skeleton, motion, gate, chain, natural)
    if ends is not None:
        values["ends_deg"] = np.degrees(ends).round(1).tolist()
        if values["seconds"] >= LEAST_SWEEP * (1 - 1e-6):
            reason = reason or half_explored(ends, earlier_ends or {})
    if reason and (fault := two_arms_fault(chain, n_dof, components)):
        # Nothing that the person does would be better.
        reason = f"{fault[0].upper()}{fault[1:]}."
    words = reason or "The hand was steady and the elbow moved."
    return Verdict(not reason, True, words, values, place=place, ends=ends)


def _straight(elbow_deg: float) -> str:
    if elbow_deg >= LEAST_BENT:
        return ""
    return (
        f"The arm is straight, with the elbow at {elbow_deg:.0f} deg: hold the hand "
        f"closer, so that it bends by {LEAST_BENT:.0f} deg or more."
    )


def _fault(
    steady: float,
    components: int,
    n_dof: int,
    width: float,
    leak: float,
    apart: Mapping[str, float],
) -> str:
    """Describe the most important fault; empty if there is none."""
    if steady < STEADY_SHARE:
        return (
            f"The hand was steady in only {100 * steady:.0f} % of the samples, "
            f"expected {100 * STEADY_SHARE:.0f} % or more."
        )
    if width < LEAST_RANGE:
        return (
            f"The elbow hardly moved: {math.degrees(width):.0f} deg along Z, expected "
            f"at least {math.degrees(LEAST_RANGE):.0f} deg."
        )
    if components > n_dof:
        return (
            f"It took {components} components, so more than the elbow moved: the hand "
            "turned or the shoulder moved too."
        )
    if not leak < ONE_PLACE:
        return f"The hand moved with the elbow, {1e3 * leak:.0f} mm from end to end."
    for name, distance in sorted(apart.items(), key=lambda item: item[1])[:1]:
        if distance < ONE_PLACE:
            return (
                f"The position is only {100 * distance:.0f} cm away from {name}, "
                f"expected at least {100 * ONE_PLACE:.0f} cm."
            )
    return ""
