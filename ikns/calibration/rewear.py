"""Markers put on again: what was learned stays, and is fitted to their new places.

Body, map and natural posture are those of the first calibration. A new static trial and
20 s of ordinary movement give the places of the markers on that body. What error is
left in them moves the hinge swivel by nearly the same angle everywhere, and ordinary
movement shows it, as far as people move alike on two days:

    shift = sd^2 / (sd^2 + r^2 / n) mean(s - s_nat)

with r the spread of s - s_nat over the movement, n the number of independent stretches
in it, and sd the spread of the error between wearings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.offsets import offsets_report
from ikns.calibration.judge.subjects import other_than_calibrated
from ikns.calibration.measured_body import measured_body
from ikns.calibration.method_summary import method_summary
from ikns.calibration.natural import LEAST_NATURAL, check_covered, check_own_arm
from ikns.calibration.readouts import moving_samples
from ikns.calibration.report import exploration_report, static_report
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput, NotEnoughData, naming
from ikns.motion.motion import Motion
from ikns.nullspace.posture_terms import wrist_of
from ikns.nullspace.readout import IntentMap, Readout
from ikns.nullspace.readout.intent import wrapped
from ikns.recording.recording import Recording

#: Spread of what a new wearing leaves in the swivel after the fit, rad: 0.6 to 1 deg on
#: simulated people (benchmarks/new_wearing.py).
WEARING_SD = np.radians(0.8)
#: A stretch of movement that is independent of the next, s: about a reach.
_STRETCH = 1.5


def rewear(
    subject: Subject,
    static: Recording,
    natural: Sequence[Recording],
    *,
    marker_set: str | Path | None = None,
    min_static: float = 1.0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Subject:
    """Fit a calibrated person's markers to their new places.

    Parameters
    ----------
    subject : Subject
        As calibrated with an earlier placement of the markers.
    static : Recording
        The person standing or sitting still.
    natural : sequence of Recording
        Ordinary movement, 20 s over the work space.
    marker_set : str or Path, optional
        The markers on the person; default that of the calibration.
    min_static : float
        Shortest static trial to accept, s.
    progress : callable, optional
        Called with (step, done, total).

    Returns
    -------
    Subject
        With the same body and maps, the new places of the markers, and intent's range
        shifted; ``report["rewear"]`` says by how much. The paper's map and proximal
        have no natural posture to be shifted by, and stay unchanged.

    Raises
    ------
    NotEnoughData
        When the static trial is too short, or the natural movement covers too little or
        is that of the other arm.
    MarkerMismatch
        As :func:`ikns.calibrate` raises it.
    InvalidInput
        When there is no natural movement, or the marker set is no longer known.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, n_points=4, rate=25, quick=True)
    >>> subject = ikns.calibrate(run.static.recording, [run.points.recording])
    >>> again = rewear(subject, run.static.recording, [run.free.recording])
    >>> again.null_space_map is subject.null_space_map
    True
    """
    if not natural:
        raise InvalidInput("expected natural movement of the new wearing, found none.")
    worn = subject.skeleton.marker_set.name
    if marker_set is None and worn not in MarkerSet.names():
        raise InvalidInput(
            f"the calibration was with the markers of '{worn}', a custom set; "
            "give its .toml file with --marker-set."
        )
    chain = subject.chain
    names = ", ".join(recording.source for recording in natural)
    measured = measured_body(
        static,
        natural,
        (),
        generic=subject.skeleton,
        marker_set=marker_set or worn,
        chain=chain,
        min_static=min_static,
        progress=progress,
        known=True,
    )
    others = other_than_calibrated(subject.report, static, measured.skeleton.marker_set)
    motions = measured.explorations
    with naming(names):
        check_own_arm(motions, chain)
    new = replace(subject, skeleton=measured.skeleton, motions=motions)
    with naming(names):
        found, about = _zeroed(new, motions)
    report: dict[str, Any] = {
        **subject.report,
        "static": static_report(static, measured.scaling, measured.skeleton.marker_set),
        "offsets_m": offsets_report(new.skeleton, chain, natural, motions),
        "rewear": about
        | {
            "natural": [
                exploration_report(
                    recording, motion, np.zeros(len(motion.time), dtype=bool), chain
                )
                for recording, motion in zip(natural, motions, strict=True)
            ],
        },
        "warnings": [*(other.sentence for other in others), *measured.warnings],
    }
    new = replace(new, report=report, readouts={**subject.readouts, **found})
    methods = dict(subject.report.get("methods", {"without": {}, "warnings": []}))
    if shift := about["shift_rad"]:
        methods["ends_rad"] = [end + shift for end in methods.get("ends_rad", [])]
        methods["places"] = [
            place | {name: place[name] + shift for name in ("lower_rad", "upper_rad")}
            for place in methods.get("places", [])
        ]
    report["methods"] = methods | {"summary": method_summary(new, [], motions)}
    return new


def _zeroed(
    subject: Subject, motions: Sequence[Motion]
) -> tuple[dict[str, Readout], dict[str, Any]]:
    """Shift intent's range by what ordinary movement shows; none without intent."""
    if "intent" not in subject.readouts:
        return {}, {"shift_rad": None, "why": "the subject has no intent"}
    readout = subject.readouts["intent"]
    learned = readout.map
    assert isinstance(learned, IntentMap)
    samples = moving_samples(
        subject.skeleton,
        subject.null_space_map,
        [],
        motions,
        subject.chain,
        max_hand_speed=subject.gate["max_hand_speed"],
    )
    place = np.concatenate([x[row] for x, _, row in samples])
    swivel = np.concatenate([s[row] for _, s, row in samples])
    check_covered(wrist_of(place))
    dt = float(np.median(np.diff(motions[0].time)))
    seconds = len(place) * dt
    if seconds < LEAST_NATURAL:
        raise NotEnoughData(
            f"expected at least {LEAST_NATURAL:g} s of natural movement, found a hand "
            f"that moves for {seconds:.1f} s: reach and carry things, 20 s over the "
            "work space."
        )
    if not learned.natural_.coverage_["frames"]:
        return {}, {
            "shift_rad": None,
            "why": "the natural posture is that of other people",
        }
    beyond = wrapped(swivel - learned.natural_.swivel(place))
    taught = learned.natural_.taught(place)
    if taught.mean() > 0.5:
        beyond = beyond[taught]
    stretches = max(len(beyond) * dt / _STRETCH, 1.0)
    mean, spread = float(beyond.mean()), float(beyond.std())
    share = WEARING_SD**2 / (WEARING_SD**2 + spread**2 / stretches)
    shift = share * mean
    moved = IntentMap.from_arrays(
        learned.natural_,
        learned.centers_,
        learned.lower_ + shift,
        learned.upper_ + shift,
        counts=learned.counts_,
        penalty=learned.penalty,
        leash=learned.leash,
    )
    return {"intent": replace(readout, map=moved)}, {
        "shift_rad": shift,
        "mean_rad": mean,
        "spread_rad": spread,
        "moving_s": seconds,
        "in_units_of_c": shift / (learned.ends_[1] - learned.ends_[0]),
    }
