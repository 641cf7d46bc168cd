"""Scaling of the skeleton to a person's static trial, with a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.size_fit import (
    fit_sizes,
    length_deviations,
    size_factors,
)
from ikns.calibration.static_trial import seen_markers, static_posture
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

    def sentences(self, source: str, *, only: Iterable[str] | None = None) -> list[str]:
        """Name the markers that were left out as nobody saw them; one sentence, if any.

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
            return []
        return [
            f"{source}: expected every marker in sight, found none of "
            f"{', '.join(sorted(lost))}: left out, as their places are unknown."
        ]


def scale(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet = "oxford24",
    min_duration: float = 1.0,
) -> tuple[Skeleton, ScalingReport]:
    """Fit the generic skeleton to a person standing or sitting still.

    Parameters
    ----------
    generic : Skeleton
        The generic body, or one from stature, mass and sex.
    static : Recording
        Static trial.
    marker_set : str, path or MarkerSet
        The markers on the person.
    min_duration : float
        Shortest static trial to accept, s.

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
        When no marker is known or a whole segment has none.

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
    reference, target, duration = static_posture(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn = reference.marker_set
    fit = fit_sizes(reference, target)
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
