"""From a static trial to the person's skeleton: one least-squares fit.

Unknown are the size of each segment (as a log factor on the generic body), where each
marker really sits, and the pose. Minimized is the sum of

    |p_m - seen_m|^2 / MARKER_SD^2              the static trial's mean markers
    |offset_m|^2 / placement_sd_m^2             markers sit near their nominal places
    s' inv(C) s,   s = log factors              people's proportions vary little
    |q|^2 / POSE_SD^2                           weak: settles what markers cannot show

A joint center thus lies midway between its medial and lateral landmarks where both are
worn, and at the landmark's nominal offset otherwise. The covariance C of the sizes has
a part that all segments share (stature), one per kind of segment, one per side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ikns.body.chains import SIDES, chain_joints
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.errors import MarkerMismatch, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.numerics.rigid import rigid_transform
from ikns.recording.recording import Recording

__all__ = ["ScalingReport", "scale", "size_covariance", "static_posture"]

Array = NDArray[np.float64]

#: Error of a marker's mean position over the trial, m: cameras are good to 0.1 to 1 mm,
#: the rest is that a body is not quite made of rigid segments.
MARKER_SD = 1e-3
#: Spread of stature over adults of both sexes, ANSUR II: 66 mm within a sex and 64 mm
#: between the means, over 1692 mm.
STATURE_SD = 0.055
#: Spread of a segment's length at a given stature, ANSUR II (SEE over mean): upper arm
#: 3.2 %, forearm 4.0 to 4.6 %, hand 3.8 to 4.3 %, half biacromial breadth 3.9 to 4.1 %;
#: the clavicle is a shorter part of the latter.
SEGMENT_SD = {
    "thorax": 0.04,
    "clavicle": 0.06,
    "upper_arm": 0.032,
    "forearm": 0.043,
    "hand": 0.04,
}
#: Left against right in one person; about 1 % (our estimate).
SIDE_SD = 0.01
#: Static poses are anything from hanging arms to a T: rad.
POSE_SD = 1.0
#: The fit has converged when a step promises less than this; one is what a single
#: residual of one standard deviation costs.
GAIN_TOLERANCE = 1e-4
#: So many frames that show every marker are enough to average; noise is then a third.
COMPLETE_FRAMES = 10
#: A marker that the static trial does not show is worn on only where its nominal place
#: is known this well, standard deviation of all directions together, m: to landmarks,
#: that is, not to clusters.
_KNOWN_PLACE = 0.02
#: Steps until the fit is given up; it takes about ten.
_MAX_STEPS = 100


@dataclass(frozen=True)
class ScalingReport:
    """How well the fit is known.

    Parameters
    ----------
    lengths : dict
        Joint-to-joint length of each segment, m.
    length_sd : dict
        Its standard deviation under the assumptions of the fit, m.
    residuals : dict
        Distance of each marker of the static trial from the fitted body, m.
    offsets : dict
        How far each marker sits from its nominal place, m.
    used, unused : tuple of str
        Markers that the static trial showed, and those that it lacked.
    dropped : tuple of str
        Markers no longer worn: static-only ones, and those that the static trial lacked
        though nobody can tell where they sit without it.
    held : tuple of str
        Joints that the markers cannot observe.
    duration : float
        Length of the static trial, s.
    converged : bool
        Whether the fit met its tolerance.
    """

    lengths: dict[str, float]
    length_sd: dict[str, float]
    residuals: dict[str, float]
    offsets: dict[str, float]
    used: tuple[str, ...]
    unused: tuple[str, ...]
    dropped: tuple[str, ...]
    held: tuple[str, ...]
    duration: float
    converged: bool


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
        What the person wears.
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
    """
    dressed, target, duration = static_posture(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn = dressed.marker_set
    factors, positions, q, covariance, converged = _fit(dressed, target)
    sized = dressed.resized(_named(factors))
    nominal = sized.marker_positions
    seen = _seen(target)
    placed = worn.at(positions)
    skeleton = sized.with_markers(
        placed.only(
            marker.label
            for marker, shown in zip(worn.markers, seen, strict=True)
            if not marker.static_only
            and (shown or np.linalg.norm(marker.placement_sd) < _KNOWN_PLACE)
        )
    )
    kept = skeleton.marker_set.labels
    at_fit = sized.with_markers(placed).markers_in_world(q)
    sd = np.sqrt(np.diag(covariance))
    lengths = skeleton.segment_lengths
    labels = np.array(worn.labels)
    report = ScalingReport(
        lengths=lengths,
        length_sd={
            name: lengths[name] * float(sd[s])
            for s, name in enumerate(SEGMENTS)
            if name in lengths
        },
        residuals=_by_label(
            labels[seen], np.linalg.norm(at_fit - target, axis=1)[seen]
        ),
        offsets=_by_label(
            labels[seen], np.linalg.norm(positions - nominal, axis=1)[seen]
        ),
        used=tuple(map(str, labels[seen])),
        unused=tuple(map(str, labels[~seen])),
        dropped=tuple(label for label in worn.labels if label not in kept),
        held=worn.held,
        duration=duration,
        converged=converged,
    )
    return skeleton, report


def static_posture(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet = "oxford24",
    min_duration: float = 1.0,
) -> tuple[Skeleton, Array, float]:
    """Dress the generic body and average the static trial; arguments as :func:`scale`.

    Returns
    -------
    dressed : Skeleton
        The generic body wearing the set at nominal places, joints of arms without any
        marker held.
    target : (M, 3) array
        Mean marker positions, m; NaN where never seen.
    duration : float
        Of the trial, s.
    """
    worn = (
        marker_set if isinstance(marker_set, MarkerSet) else MarkerSet.load(marker_set)
    )
    duration = float(static.time[-1] - static.time[0]) if len(static.time) else 0.0
    duration += 1 / static.rate if len(static.time) > 1 else 0.0
    if duration < min_duration * (1 - 1e-6):
        raise NotEnoughData(
            f"{static.source}: a static trial of at least {min_duration:g} s is "
            f"expected, found {duration:.2f} s."
        )
    target = _mean_posture(static, worn)
    worn = replace(worn, held=worn.held + _absent_joints(static, worn, target))
    return generic.with_nominal_markers(worn), target, duration


def _mean_posture(static: Recording, worn: MarkerSet) -> Array:
    """Mean marker positions with the sway of the whole body taken out, (M, 3) m."""
    markers = worn.pick(static.labels, static.markers)
    seen = _seen(markers)
    if not seen.any():
        raise MarkerMismatch(
            f"{static.source}: expected markers of {worn.name} "
            f"({', '.join(worn.labels[:4])}, ...), found "
            f"{', '.join(static.labels[:4]) or 'none'}; name the right marker set."
        )
    # A person never stands quite still, so markers averaged over different frames do
    # not fit together: frames that show everything count alone where there are some.
    complete = seen[:, seen.any(axis=0)].all(axis=1)
    if complete.sum() >= COMPLETE_FRAMES:
        markers, seen = markers[complete], seen[complete]
    reference = markers[int(np.argmax(seen.sum(axis=1)))]
    aligned = np.full_like(markers, np.nan)
    for i, frame in enumerate(markers):
        common = seen[i] & _seen(reference)
        if common.sum() >= 3:
            rotation, shift = rigid_transform(frame[common], reference[common])
            aligned[i] = frame @ rotation.T + shift
    known = _seen(aligned)
    count = known.sum(axis=0)
    mean = np.full((len(worn.markers), 3), np.nan)
    some = count > 0
    total = np.where(known[..., None], aligned, 0.0).sum(axis=0)
    mean[some] = total[some] / count[some, None]
    return mean


def _absent_joints(
    static: Recording, worn: MarkerSet, target: Array
) -> tuple[str, ...]:
    """Joints of an arm without any marker; a single bare segment is an error."""
    seen = _seen(target)
    links = {m.link for m in worn.markers}
    shown = {m.link for m, s in zip(worn.markers, seen, strict=True) if s}
    absent: tuple[str, ...] = ()
    for side in SIDES:
        arm = {link for link in links if link.startswith(side)}
        if arm and not arm & shown:
            absent += tuple(chain_joints(f"{side}_arm_clavicle"))
            links -= arm
    bare = sorted(links - shown)
    if bare:
        wanted = [m.label for m in worn.markers if m.link == bare[0]]
        raise MarkerMismatch(
            f"{static.source}: the segment {bare[0]} has no marker; expected at least "
            f"one of {', '.join(wanted)} of {worn.name}."
        )
    return tuple(joint for joint in absent if joint not in worn.held)


def _fit(generic: Skeleton, target: Array) -> tuple[Array, Array, Array, Array, bool]:
    """Gauss-Newton with step halving over sizes, marker places and pose.

    Returns log factors (S,), marker positions (M, 3), configuration, covariance of the
    log factors (S, S), and whether the fit converged.
    """
    worn = generic.marker_set
    seen = _seen(target)
    weight = np.linalg.cholesky(np.linalg.inv(size_covariance())).T
    placement = np.array([m.placement_sd for m in worn.markers])
    fixed = generic.columns(worn.held)
    free = np.setdiff1d(np.arange(generic.nv), fixed)
    n_sizes, n_markers, n_joints = len(SEGMENTS), len(placement), generic.nv - 6

    q = MarkerIK(generic.with_markers(_all_tracked(worn))).solve(target).q
    sizes, offsets = np.zeros(n_sizes), np.zeros((n_markers, 3))

    def residual(sizes: Array, offsets: Array, q: Array, positions: Array) -> Array:
        return np.concatenate(
            [
                (positions[seen] - target[seen]).ravel() / MARKER_SD,
                (offsets / placement).ravel(),
                weight @ sizes,
                q[-n_joints:] / POSE_SD,
            ]
        )

    def body(sizes: Array, offsets: Array) -> tuple[Skeleton, Skeleton]:
        sized = generic.resized(_named(sizes))
        places = sized.marker_positions + offsets
        return sized, sized.with_markers(worn.at(places))

    sized, dressed = body(sizes, offsets)
    positions, by_pose = dressed.marker_jacobian(q)
    errors = residual(sizes, offsets, q, positions)
    converged = False
    for _ in range(_MAX_STEPS):
        by_size, by_place = sized.size_jacobian(q)
        J = _assemble(by_size, by_place, by_pose, seen, weight, placement, free)
        step = cho_solve(cho_factor(J.T @ J), -J.T @ errors)
        # What the linear model still promises to gain, in squared standard deviations.
        if -(J.T @ errors) @ step < GAIN_TOLERANCE:
            converged = True
            break
        d_sizes = step[:n_sizes]
        d_offsets = step[n_sizes : n_sizes + 3 * n_markers].reshape(-1, 3)
        d_pose = np.zeros(generic.nv)
        d_pose[free] = step[n_sizes + 3 * n_markers :]
        length = min(1.0, 0.5 / max(np.abs(d_sizes).max(), np.abs(d_pose).max(), 0.1))
        while length > 1e-6:
            trial = (
                sizes + length * d_sizes,
                offsets + length * d_offsets,
                generic.integrate(q, length * d_pose),
            )
            sized, dressed = body(trial[0], trial[1])
            positions, by_pose = dressed.marker_jacobian(trial[2])
            trial_errors = residual(*trial, positions)
            if trial_errors @ trial_errors <= errors @ errors * (1 + 1e-12):
                break
            length /= 2
        sizes, offsets, q = trial
        errors = trial_errors
    by_size, by_place = sized.size_jacobian(q)
    J = _assemble(by_size, by_place, by_pose, seen, weight, placement, free)
    covariance = cho_solve(cho_factor(J.T @ J), np.eye(J.shape[1], n_sizes))[:n_sizes]
    return sizes, sized.marker_positions + offsets, q, covariance, converged


def _assemble(
    by_size: Array,
    by_place: Array,
    by_pose: Array,
    seen: NDArray[np.bool_],
    weight: Array,
    placement: Array,
    free: NDArray[np.int64],
) -> Array:
    """Jacobian of the residuals, columns sizes, marker offsets, free pose."""
    n_seen, n_markers, n_sizes = int(seen.sum()), len(seen), by_size.shape[2]
    n_pose, n_joints = len(free), by_pose.shape[2] - 6
    places = slice(n_sizes, n_sizes + 3 * n_markers)
    J = np.zeros(
        (3 * n_seen + 3 * n_markers + n_sizes + n_joints, places.stop + n_pose)
    )
    top = J[: 3 * n_seen]
    top[:, :n_sizes] = by_size[seen].reshape(3 * n_seen, n_sizes)
    for row, marker in enumerate(np.flatnonzero(seen)):
        column = n_sizes + 3 * marker
        top[3 * row : 3 * row + 3, column : column + 3] = by_place[marker]
    top[:, places.stop :] = by_pose[seen][:, :, free].reshape(3 * n_seen, n_pose)
    top /= MARKER_SD
    start = 3 * n_seen
    rows = np.arange(3 * n_markers)
    J[start + rows, n_sizes + rows] = 1 / placement.ravel()
    start += 3 * n_markers
    J[start : start + n_sizes, :n_sizes] = weight
    start += n_sizes
    for column, dof in enumerate(free):
        if dof >= 6:
            J[start + dof - 6, places.stop + column] = 1 / POSE_SD
    return J


def _seen(markers: Array) -> NDArray[np.bool_]:
    """Which markers (..., 3) were seen, (...)."""
    return np.asarray(np.isfinite(markers).all(axis=-1))


def size_covariance() -> Array:
    """Return the prior covariance of the segments' log factors, (S, S)."""
    kinds = [name.split("_", 1)[-1] if name != "thorax" else name for name in SEGMENTS]
    same = np.array([[a == b for b in kinds] for a in kinds])
    kind_sd = np.array([SEGMENT_SD[kind] for kind in kinds])
    return (
        STATURE_SD**2
        + same * np.outer(kind_sd, kind_sd)
        + SIDE_SD**2 * np.eye(len(kinds))
    )


def _named(sizes: Array) -> Mapping[str, float]:
    return dict(zip(SEGMENTS, np.exp(sizes).tolist(), strict=True))


def _by_label(labels: NDArray[np.str_], values: Array) -> dict[str, float]:
    return dict(zip(map(str, labels), values.tolist(), strict=True))


def _all_tracked(worn: MarkerSet) -> MarkerSet:
    markers = tuple(replace(marker, static_only=False) for marker in worn.markers)
    return replace(worn, markers=markers)
