"""The body once more, from the static trial and the explorations together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.joint_axes import TILTS
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.motion_fit import camera_noise, fit_motion
from ikns.calibration.size_fit import fit_sizes, length_deviations
from ikns.calibration.static_trial import seen_markers, static_posture
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording

#: Frames in use, far apart in joint angles, and fewest.
_FRAMES, _FEWEST = 40, 10
#: A frame that fits worse than this many median residuals may show exchanged markers.
_WORST = 2.0


@dataclass(frozen=True)
class BodyReport:
    """What the static trial and the explorations together say of the body."""

    lengths: dict[str, float]  # joint-to-joint length of each segment, m
    length_sd: dict[str, float]  # m, for intervals of +- 1.96 of it
    tilts: dict[str, tuple[float, float]]  # of each axis from the generic; its sd, rad
    camera_sd: float  # error of a marker that is new in every frame, m per axis
    skin_sd: float  # error of a marker that goes with the posture, m per axis
    frames: int


def fit_explorations(
    generic: Skeleton,
    skeleton: Skeleton,
    static: Recording,
    explorations: Sequence[Recording],
    motions: Sequence[Motion],
    *,
    marker_set: str | Path | MarkerSet | None = None,
    min_duration: float = 1.0,
    known: bool = False,
) -> tuple[Skeleton, BodyReport | None]:
    """Fit sizes, axes and marker places to the static trial and the explorations.

    Parameters
    ----------
    generic, static, marker_set, min_duration
        As :func:`ikns.scale` takes them.
    skeleton : Skeleton
        What it returned.
    explorations, motions : sequences of Recording and Motion
        Movements, and the same as tracked with that skeleton.
    known : bool
        Whether the generic body is the person's: only marker places are fitted.

    Returns
    -------
    skeleton : Skeleton
        With the same markers.
    report : BodyReport or None
        None where fewer than 10 frames can be used or the fit does not converge; then
        the skeleton is the one that was given.
    """
    reference, target, _ = static_posture(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn, kept = reference.marker_set, skeleton.marker_set
    # Skin with a turn of its own says little of the axes.
    columns = [
        worn.labels.index(marker.label)
        for marker in kept.markers
        if not marker.free_turn
    ]
    seen = [
        np.where(
            np.isin(np.arange(len(worn.labels)), columns)[:, None],
            worn.pick(recording.labels, recording.markers),
            np.nan,
        )
        for recording in explorations
    ]
    rows, q = _chosen(motions, seen)
    if len(rows) < _FEWEST:
        return skeleton, None
    found = fit_motion(
        reference,
        target,
        fit_sizes(reference, target, known=known),
        q,
        np.concatenate(seen)[rows],
        camera_sd=camera_noise(seen),
        known=known,
    )
    if not found.converged:
        return skeleton, None
    lengths = found.skeleton.segment_lengths
    sd = np.sqrt(np.diag(found.covariance))[len(SEGMENTS) :].tolist()
    report = BodyReport(
        lengths=lengths,
        length_sd=length_deviations(
            lengths, found.covariance[: len(SEGMENTS), : len(SEGMENTS)]
        ),
        tilts={
            f"{joint}_{'xyz'[component]}": (float(tilt), spread)
            for (joint, component, _), tilt, spread in zip(
                TILTS, found.tilts, sd, strict=True
            )
        },
        camera_sd=found.camera_sd,
        skin_sd=found.skin_sd,
        frames=len(rows),
    )
    body = found.skeleton
    return body.with_markers(body.marker_set.only(kept.labels)), report


def _chosen(motions: Sequence[Motion], seen: Sequence[Array]) -> tuple[Indices, Array]:
    """Frames far apart in joint angles among those that show most: rows, postures."""
    q = np.concatenate([motion.q for motion in motions])
    markers = np.concatenate(seen)
    residual = np.concatenate([motion.residual for motion in motions])
    good = np.concatenate(
        [motion.converged & (motion.rejected < 0).all(axis=1) for motion in motions]
    )
    good &= residual <= _WORST * np.nanmedian(residual)
    count = seen_markers(markers).sum(axis=1) * good
    if good.sum() < _FEWEST:
        return np.empty(0, dtype=np.int64), q[:0]
    # As many markers as enough frames show.
    enough = np.sort(count)[::-1][min(_FRAMES, int(good.sum())) - 1]
    rows = np.flatnonzero(good & (count >= enough))
    rows = rows[_far_apart(q[rows, 7:], _FRAMES)]
    return rows, q[rows]


def _far_apart(points: Array, n: int) -> Indices:
    """Farthest-point sampling of rows, starting with the one nearest the mean."""
    at = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())]
    nearest = np.linalg.norm(points - points[at[0]], axis=1)
    while len(at) < min(n, len(points)):
        at.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[at[-1]], axis=1))
    return np.array(at, dtype=np.int64)
