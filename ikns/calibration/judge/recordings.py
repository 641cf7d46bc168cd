"""Judge recordings of a person before they are used, as ``ikns check`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import better_set, set_worn, too_few_of_set
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.exploration import judge_exploration
from ikns.calibration.judge.finding import Finding, refused, worst_first
from ikns.calibration.judge.labels import judge_labels, judge_unseen
from ikns.calibration.judge.offsets import usual_fit
from ikns.calibration.judge.static import STILL_MARKERS, marker_displacement
from ikns.calibration.judge.subjects import (
    other_session,
    other_than_calibrated,
)
from ikns.calibration.scaling import judge_static
from ikns.calibration.static_trial import too_short
from ikns.errors import InvalidInput, MarkerMismatch, naming
from ikns.recording.recording import Recording

#: A recording in which so many markers stand still is a static trial. The others may be
#: astray; in a walk on a treadmill only half of the upper body's move by so little.
_STILL_SHARE = 0.8


@dataclass(frozen=True)
class Check:
    """What the judge says of some recordings.

    Parameters
    ----------
    findings : tuple of Finding
        The worst first.
    judged : tuple of (str, str)
        Each recording, and what it was judged as.
    """

    findings: tuple[Finding, ...]
    judged: tuple[tuple[str, str], ...]

    @property
    def usable(self) -> bool:
        """Whether all of them can be used."""
        return not refused(self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "usable": self.usable,
            "judged": [{"recording": r, "as": kind} for r, kind in self.judged],
            "findings": [finding.as_dict() for finding in self.findings],
        }


def check_recordings(
    recordings: Sequence[Recording],
    *,
    static: Recording | None = None,
    skeleton: Skeleton | None = None,
    generic: Skeleton | None = None,
    marker_set: str | Path | MarkerSet | None = None,
    min_static: float = 1.0,
    report: Mapping[str, Any] | None = None,
) -> Check:
    """Judge recordings of one person before they are used.

    With a static trial or the person's skeleton they are compared with that. Without
    either, a recording in which the person stands still is judged as a static trial.

    Parameters
    ----------
    recordings : sequence of Recording
    static : Recording, optional
        The static trial.
    skeleton : Skeleton, optional
        The person's, from a calibration; instead of a static trial.
    generic : Skeleton, optional
        Body to scale; the generic adult by default.
    marker_set : str, path or MarkerSet, optional
        The markers on the person; by default those of `generic`, and with a skeleton
        its own.
    min_static : float
        Shortest static trial to accept, s.
    report : mapping, optional
        Of the calibration that the skeleton is from, :attr:`ikns.Subject.report`:
        whose markers they were, and how far from the body.

    Returns
    -------
    Check

    Raises
    ------
    InvalidInput
        When both a static trial and a skeleton are given.
    MarkerMismatch
        When a recording holds fewer than three markers of the set.

    Examples
    --------
    >>> body = Skeleton.load()
    >>> markers = np.tile(body.markers_in_world(body.neutral()), (100, 1, 1))
    >>> worn = body.marker_set.labels
    >>> check_recordings([Recording(np.arange(100) / 100, markers, worn)]).usable
    True
    >>> markers[:, [5, 6]] = 0.0254 * markers[:, [5, 6]]
    >>> check_recordings([Recording(np.arange(100) / 100, markers, worn)]).usable
    False
    """
    if static is not None and skeleton is not None:
        raise InvalidInput(
            "expected a static trial or a calibrated person to compare with, found "
            "both; give one."
        )
    body, of = Skeleton.load() if generic is None else generic, report or {}
    if skeleton is not None:
        worn = skeleton.marker_set
    else:
        worn = set_worn(marker_set, body.marker_set)
    findings: list[Finding] = []
    judged: list[tuple[str, str]] = []
    if static is not None:
        _require_markers(static, worn)
        found = judge_static(body, static, marker_set=worn, min_duration=0.0)
        findings += [*found.findings, *too_short(static, min_static)]
        findings += judge_unseen(static, worn)
        judged.append((static.source, "static trial"))
        skeleton = None if refused(found.findings) else found.skeleton
    for recording in recordings:
        _require_markers(recording, worn)
        others = judge_labels(
            recording.source, recording.labels, worn, calibrated=skeleton is not None
        )
        if refused(others):
            findings += others
            judged.append((recording.source, f"recording without {worn.name}"))
            continue
        if static is not None:
            findings += other_session(static, recording, worn)
        elif skeleton is None and _still(recording, worn):
            found = judge_static(body, recording, marker_set=worn, min_duration=0.0)
            findings += [*found.findings, *too_short(recording, min_static)]
            findings += judge_unseen(recording, worn)
            judged.append((recording.source, "static trial"))
            continue
        findings += other_than_calibrated(of, recording, worn)
        findings += judge_exploration(
            recording, worn, body, skeleton=skeleton, usual=usual_fit(of)
        )
        own = worn if skeleton is None else skeleton.marker_set
        findings += judge_unseen(recording, own.without_static())
        known = (
            "without a static trial"
            if skeleton is None
            else "compared with the static trial"
            if static is not None
            else "compared with the calibrated person"
        )
        judged.append((recording.source, f"movement, {known}"))
    return Check(tuple(worst_first(findings)), tuple(judged))


def _require_markers(recording: Recording, worn: MarkerSet) -> None:
    with naming(recording.source):
        known = int((worn.columns(recording.labels) >= 0).sum())
    # Where another set fits, the judge says so.
    if known < 3 and better_set(worn, recording.labels) is None:
        raise MarkerMismatch(too_few_of_set(recording.source, worn, recording.labels))


def _still(recording: Recording, worn: MarkerSet) -> bool:
    markers = worn.pick(recording.labels, recording.markers)
    step = max(1, len(markers) // 100)
    spread = marker_displacement(markers[::step])
    seen = np.isfinite(markers).all(axis=2).any(axis=0)
    if not seen.any():
        return False
    return float(np.quantile(spread[seen], _STILL_SHARE)) <= STILL_MARKERS
