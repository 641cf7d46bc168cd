"""A marker set against a static trial: where markers are, and how the person stands."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.exploration import judge_exploration
from ikns.calibration.judge.finding import Finding, refused
from ikns.calibration.judge.tracking import followed
from ikns.calibration.scaling import judge_static, scale
from ikns.calibration.size_fit import fit_sizes, size_factors
from ikns.calibration.static_trial import seen_markers, static_posture
from ikns.errors import MarkerMismatch
from ikns.recording.recording import Recording


class CheckedMarker(NamedTuple):
    """One marker of a set in a static trial."""

    label: str
    link: str
    seen: bool
    offset: float  # from its nominal place on this body, m; NaN where not seen
    offset_sd: float  # the same in placement deviations, on its worst axis
    residual: float  # from where the fitted body has it, m


class CheckedJoint(NamedTuple):
    """One joint in a static trial."""

    joint: str
    angle: float  # rad
    lower: float  # limits, rad
    upper: float
    held: bool


class SetCheck(NamedTuple):
    """What a static trial says of a marker set."""

    markers: tuple[CheckedMarker, ...]
    joints: tuple[CheckedJoint, ...]
    lengths: dict[str, float]  # m
    converged: bool
    findings: tuple[Finding, ...]  # what the judge says of the static trial


class FollowedSet(NamedTuple):
    """How well a body with a marker set follows a movement."""

    residual: float  # weighted root mean square distance in the median frame, m
    markers: dict[str, float]  # median distance by label, less where weighed less, m
    findings: list[Finding]  # what the judge says of the movement


def follow_movement(
    generic: Skeleton,
    static: Recording,
    movement: Recording,
    *,
    marker_set: str | Path | MarkerSet,
    min_duration: float = 1.0,
) -> FollowedSet:
    """Fit the body to a static trial, and follow a movement of the same person.

    A static trial shows where markers sit, and so is always followed well; a movement
    shows whether they go with the bones.

    Other arguments and errors are those of :func:`ikns.scale`.
    """
    skeleton, _ = scale(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn = skeleton.marker_set
    markers = worn.pick(movement.labels, movement.markers)
    residual, off = followed(skeleton, markers)
    findings = judge_exploration(movement, worn, skeleton, skeleton=skeleton)
    return FollowedSet(
        residual, dict(zip(worn.labels, off.tolist(), strict=True)), findings
    )


def check_marker_set(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet,
    min_duration: float = 1.0,
) -> SetCheck:
    """Fit the body to a static trial, and compare the markers with their set.

    Arguments and errors are those of :func:`ikns.scale`, but a trial to which a body
    can be fitted is compared even where the judge refuses it: see ``findings``.
    """
    judged = judge_static(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    if judged.skeleton is None:
        raise MarkerMismatch(refused(judged.findings)[0].sentence)
    reference, target, _ = static_posture(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn = reference.marker_set
    fit = fit_sizes(reference, target)
    sized = reference.resized(size_factors(fit.log_sizes))
    offsets = fit.positions - sized.marker_positions
    spread = np.array([marker.placement_sd for marker in worn.markers])
    at_fit = sized.with_markers(worn.at(fit.positions)).markers_in_world(fit.q)
    seen = seen_markers(target)
    markers = tuple(
        CheckedMarker(
            marker.label,
            marker.link,
            bool(shown),
            float(np.linalg.norm(offset)) if shown else np.nan,
            float(np.max(np.abs(offset) / sd)) if shown else np.nan,
            float(np.linalg.norm(left)),
        )
        for marker, shown, offset, sd, left in zip(
            worn.markers, seen, offsets, spread, at_fit - target, strict=True
        )
    )
    angles = fit.q[-len(sized.joint_names) :]
    joints = tuple(
        CheckedJoint(joint, float(angle), float(low), float(high), joint in worn.held)
        for joint, angle, low, high in zip(
            sized.joint_names, angles, sized.lower, sized.upper, strict=True
        )
    )
    return SetCheck(
        markers,
        joints,
        sized.segment_lengths,
        fit.converged,
        tuple(judged.findings),
    )
