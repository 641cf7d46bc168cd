"""The whole calibration: scale, track markers, select still samples, fit the map."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton, check_chain
from ikns.calibration.elbow import elbow_reference, two_arms_fault
from ikns.calibration.freedoms import check_freedoms, freedom_motions
from ikns.calibration.judge.offsets import offsets_report
from ikns.calibration.measured_body import measured_body
from ikns.calibration.method_summary import method_summary, no_range_learned
from ikns.calibration.places import check_places, recorded_places
from ikns.calibration.readouts import learn_readouts
from ikns.calibration.report import (
    body_report,
    exploration_report,
    extrinsic_report,
    points_report,
    static_report,
)
from ikns.calibration.steps import LEARNING, METHODS, silent
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput, NotEnoughData, naming
from ikns.motion.excursion import other_hand_moves
from ikns.motion.marker_ik.rejection import rejection_sentence
from ikns.motion.motion import Motion
from ikns.nullspace.map import MapWarning, NullSpaceMap, still_mask
from ikns.nullspace.map.samples import no_still_sample, samples_in
from ikns.nullspace.readout import Readout
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
    marker_set: str | Path | MarkerSet | None = None,
    chain: ChainLike = "right_arm",
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
    other_methods: bool = True,
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
        posture of the method intent. Without it, the reaches between the points are
        used.
    generic : Skeleton, optional
        Body to start from; :meth:`Skeleton.from_anthropometry` when stature, mass and
        sex are known. Default: the generic adult.
    marker_set : str, path or MarkerSet, optional
        The markers on the person; by default those of `generic`.
    chain : str or Chain
        Joints of the task, by the name of a chain that comes with the package
        (``urdf/chains.toml``) or as a :class:`ikns.Chain`. All others are extrinsic:
        how much they moved is reported.
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
    other_methods : bool
        Whether to learn the readouts of the methods proximal and intent, too.
    progress : callable, optional
        Called with (step, done, total); the steps are those of
        :func:`ikns.calibration.steps.calibration_steps`.

    Returns
    -------
    Subject
        Its report lists the still samples of every PCA point, and which points were
        left out.

    Raises
    ------
    MarkerMismatch
        When a segment of the chain has no marker in a recording, or a recording must
        not be used: swapped names, wrong unit, different person.
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
    _check_given(explorations, min_still=min_still, min_rest=min_rest)
    if not isinstance(chain, str):
        check_chain(generic or Skeleton.load(), chain, n_dof=n_dof)
    names = ", ".join(recording.source for recording in explorations)
    measured = measured_body(
        static,
        explorations,
        natural,
        generic=generic,
        marker_set=marker_set,
        chain=chain,
        min_static=min_static,
        progress=progress,
    )
    say = progress or silent
    say(LEARNING, 0, 1)
    skeleton, motions = measured.skeleton, measured.explorations
    pairs = [
        (m, still_mask(m, chain, max_hand_speed=max_hand_speed, min_duration=min_rest))
        for m in motions
    ]
    enough = samples_in(min_still, explorations[0].rate)
    learned = NullSpaceMap(
        n_points,
        n_dof=n_dof,
        variance=variance,
        radius=radius,
        outside=outside,
        interpolation=interpolation,
        # Fewer samples than joints do not determine all components.
        min_samples=max(enough, len(chain_joints(chain)) + 1),
    )
    side = _say_side(motions, chain)
    if not any(gate.any() for _, gate in pairs):
        found = no_still_sample(motions, chain, max_hand_speed, min_duration=min_rest)
        raise NotEnoughData(f"{names}: {found} {side}".rstrip())
    with naming(names):
        hands, caught = _fit(learned, skeleton, pairs, chain, side)
    readouts: dict[str, Readout] = {}
    methods: dict[str, Any] = {"without": {}, "warnings": []}
    if other_methods:
        say(METHODS, 0, 1)
        with naming(", ".join(recording.source for recording in natural) or names):
            readouts, methods = learn_readouts(
                skeleton,
                learned,
                pairs,
                chain,
                natural=measured.natural,
                max_hand_speed=max_hand_speed,
            )
    report = {
        "chain": str(chain),
        "marker_set": skeleton.marker_set.name,
        "settings": _settings(learned, max_hand_speed, min_rest),
        "methods": methods,
        "static": static_report(static, measured.scaling, skeleton.marker_set),
        "body": body_report(measured.fitted),
        "explorations": [
            exploration_report(recording, motion, gate, chain)
            for recording, (motion, gate) in zip(explorations, pairs, strict=True)
        ],
        "offsets_m": offsets_report(skeleton, chain, explorations, motions),
        "points": points_report(learned, rate=explorations[0].rate),
        "extrinsic": extrinsic_report(skeleton, pairs, chain),
        "warnings": [
            *measured.warnings,
            *_rejections(explorations, motions, chain),
            *(f"{names}: {fault}" for fault in _faults(learned, chain, side)),
            *caught,
        ],
    }
    shown = _shown(hands, learned)
    subject = Subject(skeleton, learned, chain, report, motions, shown, readouts)
    if other_methods:
        summary = method_summary(subject, natural=measured.natural, own=True)
        methods["summary"] = summary
        methods["warnings"] += filter(None, [no_range_learned(summary)])
        say(METHODS, 1, 1)
    return subject


def _settings(
    learned: NullSpaceMap, max_hand_speed: float, min_rest: float
) -> dict[str, Any]:
    return {
        "n_points": learned.n_points,
        "n_dof": learned.n_dof,
        "variance": learned.variance,
        "max_hand_speed_m_s": max_hand_speed,
        "min_rest_s": min_rest,
        "min_samples": learned.min_samples,
        "clusters_start": learned.start_,
    }


def _check_given(explorations: Sequence[Recording], **given: float) -> None:
    if not explorations:
        raise InvalidInput("expected at least one exploration recording, found none.")
    for name, seconds in given.items():
        if not 0 <= seconds < np.inf:
            raise InvalidInput(f"expected {name} of at least 0 s, found {seconds:g}.")


def _shown(hands: Array, learned: NullSpaceMap) -> Array:
    """Still hands (K, 3) and their point from 1 on, at most so many for pictures."""
    return np.column_stack([hands, learned.labels_ + 1.0])[:: len(hands) // _SHOWN + 1]


def _fit(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    pairs: Sequence[tuple[Motion, Mask]],
    chain: ChainLike,
    side: str,
) -> tuple[Array, list[str]]:
    """Fit the map to the still samples; return their hand positions, and warnings.

    `side` is what to add where there are too few.
    """
    hands = [motion.task_position(chain)[gate] for motion, gate in pairs]
    x = np.concatenate(hands)
    q = np.concatenate([motion.chain_angles(chain)[gate] for motion, gate in pairs])
    posture = np.concatenate([motion.angles[gate] for motion, gate in pairs])
    learned.reference = elbow_reference(
        skeleton, posture.mean(axis=0), chain, n_dof=learned.n_dof
    )
    places = recorded_places(hands, n_points=learned.n_points)
    motions = None
    if learned.n_dof > 1:
        motions = freedom_motions(
            skeleton, posture.mean(axis=0), chain, n_dof=learned.n_dof
        )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        try:
            check_places(x, n_points=learned.n_points)
            learned.fit(x, q, groups=places, motions=motions)
            together = [] if motions is None else check_freedoms(learned, q)
        except NotEnoughData as error:
            if not side:
                raise
            raise NotEnoughData(f"{error} {side}") from None
    return x, [*together, *(str(warning.message) for warning in caught)]


def _faults(learned: NullSpaceMap, chain: ChainLike, side: str) -> list[str]:
    """Say what speaks against the chain or its freedoms."""
    arms = two_arms_fault(chain, learned.n_dof, learned.n_components_)
    return [fault for fault in (side, arms and f"{arms}.") if fault]


def _rejections(
    recordings: Sequence[Recording], motions: Sequence[Motion], chain: ChainLike
) -> list[str]:
    """Say which frames were left out."""
    return [
        f"{recording.source}: {left_out}."
        for recording, motion in zip(recordings, motions, strict=True)
        if (left_out := rejection_sentence(motion, chain))
    ]


def _say_side(motions: Sequence[Motion], chain: ChainLike) -> str:
    """Say that the other hand moved, if it did."""
    other = other_hand_moves(motions, chain, times=_OTHER_SIDE)
    if not other:
        return ""
    return f"{other[0].upper()}{other[1:]}: {chain} seems to be the wrong side."
