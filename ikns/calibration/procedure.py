"""The whole calibration: scale, track markers, select still samples, fit the map."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from ikns.body.chains import chain_joints, chain_sides
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.elbow import elbow_reference, two_arms_fault
from ikns.calibration.exploration_fit import fit_explorations
from ikns.calibration.judge.exploration import judge_exploration
from ikns.calibration.judge.finding import refused
from ikns.calibration.judge.subjects import other_subject
from ikns.calibration.places import recorded_places
from ikns.calibration.readouts import learn_readouts
from ikns.calibration.report import (
    body_report,
    exploration_report,
    extrinsic_report,
    points_report,
    static_report,
)
from ikns.calibration.scaled_body import scaled_body
from ikns.calibration.scaling import ScalingReport, scale
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput, MarkerMismatch, NotEnoughData, naming
from ikns.motion.excursion import other_hand_moves
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.rejection import rejection_sentence
from ikns.motion.motion import Motion
from ikns.nullspace.map import MapWarning, NullSpaceMap, still_mask
from ikns.nullspace.map.samples import no_still_sample
from ikns.recording.recording import Recording

#: So many times as far as a chain's own hand the other one moves only where the chain
#: is the wrong one.
_OTHER_SIDE = 3.0
#: Most still samples that are kept for pictures.
_SHOWN = 3000


def calibrate(
    static: Recording | None,
    explorations: Sequence[Recording],
    *,
    natural: Sequence[Recording] = (),
    generic: Skeleton | None = None,
    marker_set: str | Path = "oxford24",
    chain: str = "right_arm",
    n_points: int = 10,
    n_dof: int = 1,
    max_hand_speed: float = 0.05,
    variance: float = 0.8,
    radius: float | None = None,
    outside: Literal["nearest", "project", "nan"] = "nearest",
    interpolation: Literal["natural", "laplace", "nearest"] = "natural",
    min_static: float = 1.0,
    min_still: float = 0.5,
    min_rest: float = 0.0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Subject:
    """Calibrate a person.

    Parameters
    ----------
    static : Recording, optional
        The person standing or sitting still. Without one, `generic` is taken for the
        person's body, with the spread of people of one stature.
    explorations : sequence of Recording
        The hand held at the PCA points while the arm moves freely. A recording of one
        point alone says which samples are of one place.
    natural : sequence of Recording
        Ordinary movement with everyday objects, 20 s over the work space: the natural
        posture of the method intent. Without it the reaches between the points tell.
    generic : Skeleton, optional
        Body to start from; :meth:`Skeleton.from_anthropometry` when stature, mass and
        sex are known. Default: the generic adult.
    marker_set : str or Path
        The markers on the person.
    chain : str
        Joints of the task, see :data:`ikns.body.chains.CHAINS`. All others are
        extrinsic: how much they moved is reported.
    n_points, n_dof, variance, radius, outside, interpolation
        Of :class:`NullSpaceMap`; radius in m.
    max_hand_speed : float
        Gate on the hand, m/s.
    min_static : float
        Shortest static trial to accept, s.
    min_still : float
        A PCA point with less still time is left out, s. The default is a tenth of the
        5 s per point of the protocol.
    min_rest : float
        Shorter rests of the hand do not count, s; see
        :func:`ikns.nullspace.map.still_mask`. With 0.5 a recording may also hold free
        movement, in which the hand is slow for a moment wherever it reverses.
    progress : callable, optional
        Called with (step, done, total).

    Returns
    -------
    Subject
        Its report lists the still samples of every PCA point, and which points were
        left out.

    Raises
    ------
    MarkerMismatch
        When a segment of the chain has no marker in a recording, or a recording must
        not be used: names exchanged, another unit, another person.
    NotEnoughData
        When the static trial is too short or the person moves in it, no sample is
        still, or the usable points are fewer than 4 or in one plane.
    InvalidInput
        When a parameter is out of its range.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, quick=True
    ... )
    >>> subject = calibrate(run.static.recording, [run.points.recording])
    >>> len(subject.null_space_map.centers_), subject.chain
    (10, 'right_arm')
    """
    if not explorations:
        raise InvalidInput("expected at least one exploration recording, found none.")
    for name, seconds in (("min_still", min_still), ("min_rest", min_rest)):
        if not 0 <= seconds < np.inf:
            raise InvalidInput(f"expected {name} of at least 0 s, found {seconds:g}.")
    names = ", ".join(recording.source for recording in explorations)
    body = Skeleton.load() if generic is None else generic
    if static is None:
        if generic is None:
            raise InvalidInput(
                "expected a static trial, or a body from stature, mass and sex."
            )
        skeleton, scaling = scaled_body(body, explorations, marker_set=marker_set)
    else:
        with naming(static.source):
            skeleton, scaling = scale(
                body, static, marker_set=marker_set, min_duration=min_static
            )
    warned = [
        sentence
        for recording in explorations
        for sentence in _judged(static, recording, skeleton, chain)
    ]
    recordings = (*explorations, *natural)
    tracked = _tracked(skeleton, recordings, chain, progress)
    fitted = None
    if static is not None:
        skeleton, fitted = fit_explorations(
            body,
            skeleton,
            static,
            explorations,
            tracked[: len(explorations)],
            marker_set=marker_set,
            min_duration=min_static,
        )
    if fitted is not None:
        tracked = _tracked(skeleton, recordings, chain, progress)
    motions = tracked[: len(explorations)]
    gates = [
        still_mask(motion, chain, max_hand_speed=max_hand_speed, min_duration=min_rest)
        for motion in motions
    ]
    other = other_hand_moves(motions, chain, times=_OTHER_SIDE)
    if not any(gate.any() for gate in gates):
        raise NotEnoughData(
            f"{names}: "
            + no_still_sample(motions, chain, max_hand_speed, min_duration=min_rest)
            + (f" {_say_side(other, chain)}" if other else "")
        )
    pairs = list(zip(motions, gates, strict=True))
    hands = [motion.task_position(chain)[gate] for motion, gate in pairs]
    x = np.concatenate(hands)
    q = np.concatenate([motion.chain_angles(chain)[gate] for motion, gate in pairs])
    posture = np.concatenate([motion.angles[gate] for motion, gate in pairs])
    enough = int(np.ceil(min_still * explorations[0].rate))
    learned = NullSpaceMap(
        n_points,
        n_dof=n_dof,
        variance=variance,
        radius=radius,
        outside=outside,
        interpolation=interpolation,
        reference=elbow_reference(skeleton, posture.mean(axis=0), chain, n_dof=n_dof),
        # Fewer samples than joints do not determine all components.
        min_samples=max(enough, len(chain_joints(chain)) + 1),
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        with naming(names):
            try:
                learned.fit(x, q, groups=recorded_places(hands, n_points=n_points))
            except NotEnoughData as error:
                if not other:
                    raise
                raise NotEnoughData(f"{error} {_say_side(other, chain)}") from None
    with naming(", ".join(recording.source for recording in natural) or names):
        readouts, methods = learn_readouts(
            skeleton,
            learned,
            pairs,
            chain,
            natural=tracked[len(explorations) :],
            max_hand_speed=max_hand_speed,
        )
    report = {
        "chain": chain,
        "marker_set": skeleton.marker_set.name,
        "settings": {
            "n_points": n_points,
            "n_dof": n_dof,
            "variance": variance,
            "max_hand_speed_m_s": max_hand_speed,
            "min_rest_s": min_rest,
            "min_samples": learned.min_samples,
            "clusters_start": learned.start_,
        },
        "methods": methods,
        "static": static_report(static, scaling),
        "body": body_report(fitted),
        "explorations": [
            exploration_report(recording, motion, gate, chain)
            for recording, (motion, gate) in zip(explorations, pairs, strict=True)
        ],
        "points": points_report(learned, rate=explorations[0].rate),
        "extrinsic": extrinsic_report(skeleton, pairs, chain),
        "warnings": [
            *(
                [_assumed(scaling)]
                if static is None
                else _left_out(static, scaling, marker_set, explorations, chain)
            ),
            *warned,
            *(
                f"{recording.source}: {left_out}."
                for recording, motion in zip(explorations, motions, strict=True)
                if (left_out := rejection_sentence(motion, chain))
            ),
            *([f"{names}: {_say_side(other, chain)}"] if other else []),
            *(
                f"{names}: {fault}."
                for fault in [two_arms_fault(chain, n_dof, learned.n_components_)]
                if fault
            ),
            *(str(warning.message) for warning in caught),
        ],
    }
    step = len(x) // _SHOWN + 1
    shown = np.column_stack([x, learned.labels_ + 1.0])[::step]
    return Subject(skeleton, learned, chain, report, motions, shown, readouts)


def _assumed(scaling: ScalingReport) -> str:
    """Say what is not known without a static trial."""
    arm = [sd for name, sd in scaling.length_sd.items() if name.endswith("arm")]
    return (
        "no static trial: segments have the lengths of an average person of this "
        f"stature, and people differ from that by {1000 * min(arm):.0f} to "
        f"{1000 * max(arm):.0f} mm (standard deviation of an arm's segments)."
    )


def _judged(
    static: Recording | None, recording: Recording, skeleton: Skeleton, chain: str
) -> list[str]:
    """Return warnings of a recording, or refuse it."""
    worn = skeleton.marker_set
    # Without a static trial the person's own distances are not known.
    known = None if static is None else skeleton
    findings = judge_exploration(recording, worn, skeleton, skeleton=known, chain=chain)
    if static is not None:
        findings += other_subject(static, recording, worn)
    if faults := refused(findings):
        raise MarkerMismatch(faults[0].sentence)
    return [finding.sentence for finding in findings if finding.severity == "warn"]


def _say_side(other: str, chain: str) -> str:
    return f"{other[0].upper()}{other[1:]}: {chain} seems to be the wrong side."


def _tracked(
    skeleton: Skeleton,
    recordings: Sequence[Recording],
    chain: str,
    progress: Callable[[str, int, int], None] | None,
) -> tuple[Motion, ...]:
    """Marker inverse kinematics of every recording."""
    solver = MarkerIK(skeleton)
    return tuple(
        solver.track(
            recording,
            chain=chain,
            progress=progress and partial(progress, Path(recording.source).name),
        )
        for recording in recordings
    )


def _left_out(
    static: Recording,
    scaling: ScalingReport,
    marker_set: str | Path,
    recordings: Sequence[Recording],
    chain: str,
) -> list[str]:
    """Name markers, of the chain or seen later, that the static trial lacks.

    The other arm's may be missing from all of them: nobody asked for it.
    """
    worn = MarkerSet.load(marker_set)
    own = ("thorax", *chain_sides(chain))
    counts = np.array([marker.link.startswith(own) for marker in worn.markers])
    for recording in recordings:
        markers = worn.pick(recording.labels, recording.markers)
        counts |= np.isfinite(markers).all(axis=2).any(axis=0)
    named = [label for label, count in zip(worn.labels, counts, strict=True) if count]
    return scaling.sentences(static.source, only=named)
