"""A body without a static trial: average proportions, markers at nominal places."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ikns.body.marker_set import Marker, MarkerSet
from ikns.body.set_choice import set_worn
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import ScalingReport
from ikns.calibration.size_fit import SEGMENT_SD, SIDE_SD
from ikns.calibration.static_trial import absent_joints
from ikns.errors import MarkerMismatch
from ikns.recording.recording import Recording

#: Markers whose place is known at least this well are tracked, standard deviation of
#: all directions together, m: landmarks and joint centers, not clusters. On a segment
#: that has too few of them the next best ones are.
_PLACED = 0.045
#: Worse than this a place is unknown, m.
_UNKNOWN = 0.06
#: Markers that show where the trunk is.
_TRUNK = 3


def scaled_body(
    generic: Skeleton,
    recordings: Sequence[Recording],
    *,
    marker_set: str | Path | MarkerSet | None = None,
) -> tuple[Skeleton, ScalingReport]:
    """Put a marker set on a body from stature, mass and sex, without a static trial.

    Parameters
    ----------
    generic : Skeleton
        From :meth:`Skeleton.from_anthropometry`.
    recordings : sequence of Recording
        What will be tracked: the joints of an arm without markers in them are held.
    marker_set : str, path or MarkerSet, optional
        The markers on the person; by default those of the generic skeleton.

    Returns
    -------
    skeleton : Skeleton
        With the markers whose places are known without a static trial.
    report : ScalingReport
        Its lengths spread as those of people of one stature do.

    Raises
    ------
    MarkerMismatch
        When a segment carries only markers whose places a static trial would have to
        show, such as clusters.

    Examples
    --------
    >>> body = Skeleton.from_anthropometry(1.75, 70, "female")
    >>> frame = np.ones((1, 9, 3))
    >>> keypoints = Recording([0.0], frame, MarkerSet.load("halpe26").labels)
    >>> _, report = scaled_body(body, [keypoints], marker_set="halpe26")
    >>> round(1000 * report.length_sd["right_forearm"])
    12
    """
    worn = set_worn(marker_set, generic.marker_set)
    seen = np.zeros(len(worn.markers), dtype=bool)
    for recording in recordings:
        markers = worn.pick(recording.labels, recording.markers)
        seen |= np.isfinite(markers).all(axis=2).any(axis=0)
    source = ", ".join(recording.source for recording in recordings)
    labels = [label for recording in recordings for label in recording.labels]
    absent = absent_joints(source, worn, seen, labels)
    worn = replace(worn, held=worn.held + absent)
    kept = _known_places(worn)
    skeleton = generic.with_nominal_markers(worn.only(kept))
    lengths = skeleton.segment_lengths
    report = ScalingReport(
        lengths=lengths,
        length_sd=length_sd_at_stature(lengths),
        residuals={},
        offsets={},
        unused=(),
        dropped=tuple(label for label in worn.labels if label not in kept),
        held=worn.held,
        duration=0.0,
        converged=True,
    )
    return skeleton, report


def length_sd_at_stature(lengths: Mapping[str, float]) -> dict[str, float]:
    """How much lengths (m) differ among people of one stature, m; by segment.

    >>> round(length_sd_at_stature({"right_forearm": 0.26})["right_forearm"], 4)
    0.0115
    """
    return {
        name: length * math.hypot(SEGMENT_SD[name.split("_", 1)[-1]], SIDE_SD)
        for name, length in lengths.items()
    }


def _known_places(worn: MarkerSet) -> set[str]:
    """Labels of the markers to track, at places known well enough."""
    kept: set[str] = set()
    for link in dict.fromkeys(marker.link for marker in worn.markers):
        own = [m for m in worn.markers if m.link == link and not m.static_only]
        own.sort(key=_unsure)
        need = _TRUNK if link == "thorax" else 1
        known = [m for i, m in enumerate(own) if i < need or _unsure(m) < _PLACED]
        if known and _unsure(known[0]) > _UNKNOWN:
            raise MarkerMismatch(
                f"expected a static trial, which shows where on the segment {link} the "
                f"markers of {worn.name} are ({', '.join(m.label for m in own[:3])})."
            )
        kept |= {m.label for m in known}
    return kept


def _unsure(marker: Marker) -> float:
    return float(np.linalg.norm(marker.placement_sd))
