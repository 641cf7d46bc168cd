"""A recording of a known person: judged, then tracked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.exploration import judge_exploration
from ikns.calibration.judge.finding import Finding, refused, worst_first
from ikns.calibration.judge.offsets import usual_fit
from ikns.calibration.judge.subjects import (
    other_session,
    other_than_calibrated,
)
from ikns.errors import MarkerMismatch, naming
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.rejection import rejection_sentence
from ikns.motion.motion import Motion
from ikns.motion.unseen import warn_unseen
from ikns.recording.recording import Recording


def judged_motion(
    skeleton: Skeleton,
    recording: Recording,
    *,
    chain: ChainLike | None = None,
    static: Recording | None = None,
    measured: bool = True,
    report: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Motion, list[str]]:
    """Judge a recording, track it, and say what it lacks.

    :meth:`MarkerIK.track` alone tracks a recording whatever is wrong with it.

    Parameters
    ----------
    skeleton : Skeleton
        The person's.
    recording : Recording
    chain : str, optional
        What the recording is meant to show, see :class:`ikns.Chain`.
    static : Recording, optional
        The static trial, whose subject must be the recording's.
    measured : bool
        Whether the skeleton comes from a static trial; assumed distances between
        markers are not compared.
    report : mapping, optional
        Of the person's calibration, :attr:`ikns.Subject.report`: whose markers they
        were, and how far from the body.
    progress : callable, optional
        Called with (frames done, frames in total).

    Returns
    -------
    motion : Motion
    warnings : list of str
        What the judge warns of, and which frames are left out.

    Raises
    ------
    MarkerMismatch
        When the recording must not be used, or never shows a segment of the chain.
    NotEnoughData
        When `chain` is asked for and there are fewer than two frames.

    Warns
    -----
    RecordingWarning
        Of markers that no frame shows.
    """
    shown = "both_arms" if chain is None else chain
    warned = require_usable(
        skeleton,
        recording,
        chain=shown,
        static=static,
        measured=measured,
        report=report,
    )
    warn_unseen(skeleton, recording, chain)
    motion = MarkerIK(skeleton).track(recording, chain=chain, progress=progress)
    if left_out := rejection_sentence(motion, shown):
        warned.append(f"{recording.source}: {left_out}.")
    return motion, warned


def require_usable(
    skeleton: Skeleton,
    recording: Recording,
    *,
    chain: ChainLike = "both_arms",
    static: Recording | None = None,
    measured: bool = True,
    report: Mapping[str, Any] | None = None,
) -> list[str]:
    """Return the judge's warnings of a recording of a known person, or refuse it.

    Arguments and errors as for :func:`judged_motion`.
    """
    findings = known_findings(
        skeleton, recording, chain=chain, measured=measured, report=report
    )
    if static is not None:
        findings += other_session(static, recording, skeleton.marker_set)
    if faults := refused(findings):
        raise MarkerMismatch(faults[0].sentence)
    return [finding.sentence for finding in findings if finding.severity == "warn"]


def known_findings(
    skeleton: Skeleton,
    recording: Recording,
    *,
    chain: ChainLike = "both_arms",
    measured: bool = True,
    report: Mapping[str, Any] | None = None,
) -> list[Finding]:
    """Judge a recording of a known person, the worst first, and refuse nothing.

    Arguments as for :func:`judged_motion`.
    """
    of = report or {}
    with naming(recording.source):
        findings = judge_exploration(
            recording,
            skeleton.marker_set,
            skeleton,
            skeleton=skeleton if measured else None,
            chain=chain,
            usual=usual_fit(of),
        )
        others = other_than_calibrated(of, recording, skeleton.marker_set)
    return worst_first([*others, *findings])
