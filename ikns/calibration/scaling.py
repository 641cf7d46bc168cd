"""Scaling of the skeleton to a person's static trial, with a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import set_worn
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import Finding, refused, worst_first
from ikns.calibration.judge.labels import judge_labels
from ikns.calibration.judge.sides import labels_in_file
from ikns.calibration.judge.static import body_size, judge_posture, movement
from ikns.calibration.judge.trace_findings import judge_traces
from ikns.calibration.size_fit import (
    SizeFit,
    fit_sizes,
    length_deviations,
    size_factors,
)
from ikns.calibration.static_trial import seen_markers, static_posture
from ikns.errors import MarkerMismatch, NotEnoughData
from ikns.recording.recording import Recording

#: A marker that the static trial does not show is kept only where its nominal place is
#: known this well, standard deviation of all directions together, m: on landmarks, not
#: in clusters.
_KNOWN_PLACE = 0.02


@dataclass(frozen=True)
class ScalingReport:
    """What the fit found, and how well it is known.

    Dropped are the markers not kept: static-only ones, and those that the static trial
    lacked and whose place is unknown without it.
    """

    lengths: dict[str, float]  # joint-to-joint length of each segment, m
    length_sd: dict[str, float]  # its deviation under the assumptions of the fit, m
    residuals: dict[str, float]  # of each marker of the trial from the fitted body, m
    offsets: dict[str, float]  # of each marker from its nominal place, m
    unused: tuple[str, ...]  # markers that the static trial lacked
    dropped: tuple[str, ...]
    held: tuple[str, ...]  # joints that the markers cannot observe
    duration: float  # length of the static trial, s
    converged: bool  # whether the fit met its tolerance
    warnings: tuple[str, ...] = ()  # what the judge found and did not refuse

    def sentences(self, source: str, *, only: Iterable[str] | None = None) -> list[str]:
        """Say what the judge warns of, and which markers were left out as never seen.

        Parameters
        ----------
        source : str
            Name of the static trial.
        only : iterable of str, optional
            Name no other markers.
        """
        lost = set(self.unused) & set(self.dropped)
        if only is not None:
            lost &= set(only)
        if not lost:
            return [*self.warnings]
        return [
            *self.warnings,
            f"{source}: expected every marker to be visible, found none of "
            f"{', '.join(sorted(lost))}: left out because their places are unknown.",
        ]


class StaticJudgment(NamedTuple):
    """What a judge says of a static trial."""

    findings: list[Finding]  # the worst first
    skeleton: Skeleton | None  # the person's; None where there is nothing to fit
    report: ScalingReport | None


def scale(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet | None = None,
    min_duration: float = 1.0,
    known: bool = False,
) -> tuple[Skeleton, ScalingReport]:
    """Fit the generic skeleton to a person standing or sitting still.

    Parameters
    ----------
    generic : Skeleton
        The generic body, or one from stature, mass and sex.
    static : Recording
        Static trial.
    marker_set : str, path or MarkerSet, optional
        The markers on the person; by default those of the generic skeleton.
    min_duration : float
        Shortest static trial to accept, s.
    known : bool
        Whether the generic body is the person's own, measured before: only the places
        of the markers are fitted.

    Returns
    -------
    skeleton : Skeleton
        A new skeleton with the markers whose places are known, without the static-only
        ones.
    report : ScalingReport

    Raises
    ------
    NotEnoughData
        When the trial is too short or the person moves in it.
    MarkerMismatch
        When no marker is known or a whole segment has none, or no person can stand like
        that: swapped names, wrong unit, mirror image.

    Examples
    --------
    >>> person = Skeleton.from_anthropometry(1.80, 75, "male")
    >>> markers = np.tile(person.markers_in_world(person.neutral()), (100, 1, 1))
    >>> static = Recording(np.arange(100) / 100, markers, person.marker_set.labels)
    >>> skeleton, report = scale(Skeleton.load(), static)
    >>> true = person.segment_lengths["right_forearm"]
    >>> abs(report.lengths["right_forearm"] - true) < 0.005
    True
    """
    found = judge_static(
        generic,
        static,
        marker_set=marker_set,
        min_duration=min_duration,
        known=known,
    )
    if faults := refused(found.findings):
        moved = faults[0].kind == "moved"
        raise (NotEnoughData if moved else MarkerMismatch)(faults[0].sentence)
    assert found.skeleton is not None
    assert found.report is not None
    return found.skeleton, replace(
        found.report, warnings=tuple(finding.sentence for finding in found.findings)
    )


def judge_static(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet | None = None,
    min_duration: float = 1.0,
    known: bool = False,
    repair: bool = True,
) -> StaticJudgment:
    """Judge a static trial, and fit a skeleton to it where that makes sense.

    Arguments are those of :func:`scale`, which raises what is refused here. The same
    errors as there are raised for a trial that is too short or lacks a segment.
    Without `repair` names are not exchanged to see what fits: far faster.
    """
    where = static.source
    worn = set_worn(marker_set, generic.marker_set)
    others = judge_labels(where, static.labels, worn, calibrated=known)
    if refused(others):
        return StaticJudgment(others, None, None)
    markers = worn.pick(static.labels, static.markers)
    size = body_size(where, markers, generic.with_nominal_markers(worn))
    if size:
        return StaticJudgment(size, None, None)
    traces, spoiled, measured = judge_traces(where, worn.labels, static.time, markers)
    # What is known to be wrong for a moment is left out, and warned of.
    kept = static
    if traces:
        kept = Recording(
            static.time[~spoiled], measured[~spoiled], worn.labels, static.source
        )
    reference, target, duration = static_posture(
        generic, kept, marker_set=worn, min_duration=min_duration
    )
    findings = others + traces + movement(where, worn.labels, measured[~spoiled])
    if refused(findings):
        return StaticJudgment(worst_first(findings), None, None)
    # The judge knows people, not this one: a known body must not look exchanged only
    # because its markers are put elsewhere than usual.
    fit = fit_sizes(reference, target)
    findings += judge_posture(
        where,
        reference,
        target,
        fit,
        in_file=labels_in_file(reference.marker_set, static.labels),
        repair=repair,
    )
    if known:
        fit = fit_sizes(reference, target, known=True)
    skeleton, report = _fitted(reference, target, fit, duration)
    return StaticJudgment(worst_first(findings), skeleton, report)


def _fitted(
    reference: Skeleton, target: Array, fit: SizeFit, duration: float
) -> tuple[Skeleton, ScalingReport]:
    """Return the body with the markers that are kept, and how well it is known."""
    worn = reference.marker_set
    sized = reference.resized(size_factors(fit.log_sizes))
    placed = worn.at(fit.positions)
    seen = seen_markers(target)
    skeleton = sized.with_markers(
        placed.only(
            marker.label
            for marker, shown in zip(worn.markers, seen, strict=True)
            if not marker.static_only
            and (shown or np.linalg.norm(marker.placement_sd) < _KNOWN_PLACE)
        )
    )
    at_fit = sized.with_markers(placed).markers_in_world(fit.q)
    kept, lengths = skeleton.marker_set.labels, skeleton.segment_lengths
    labels = np.array(worn.labels)
    report = ScalingReport(
        lengths=lengths,
        length_sd=length_deviations(lengths, fit.covariance),
        residuals=_distances(labels[seen], at_fit[seen], target[seen]),
        offsets=_distances(
            labels[seen], fit.positions[seen], sized.marker_positions[seen]
        ),
        unused=tuple(map(str, labels[~seen])),
        dropped=tuple(label for label in worn.labels if label not in kept),
        held=worn.held,
        duration=duration,
        converged=fit.converged,
    )
    return skeleton, report


def _distances(labels: NDArray[np.str_], a: Array, b: Array) -> dict[str, float]:
    """Distance of matching points (M, 3) by label."""
    distance = np.linalg.norm(a - b, axis=1)
    return dict(zip(map(str, labels), distance.tolist(), strict=True))
