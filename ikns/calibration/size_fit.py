"""Least-squares fit of segment sizes, marker places and pose to a static trial.

The unknowns are the size of each segment (as the log of a factor on the generic body),
the place of each marker, and the pose. The cost is the sum of

    |p_m - seen_m|^2 / MARKER_SD^2              the static trial's mean markers
    |offset_m|^2 / placement_sd_m^2             markers sit near their nominal places
    s' inv(C) s,   s = log factors              people's proportions vary little
    |q|^2 / POSE_SD^2                           weak: for what markers do not show

So a joint center lies midway between its medial and lateral landmarks where both are
worn, and at the landmark's nominal offset otherwise. The covariance C of the sizes has
a part that all segments share (stature), one per kind of segment, and one per side.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.static_trial import seen_markers
from ikns.motion.marker_ik import MarkerIK

#: Error of a marker's mean position over the trial, m: 0.1 to 1 mm of it is that of the
#: cameras, the rest comes from segments that are not quite rigid.
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
#: A body that was measured before keeps its sizes and axes: they may change by this
#: share, 0.3 mm of an upper arm, and by as many rad.
KNOWN_SD = 1e-3
#: Static poses range from hanging arms to a T pose, rad.
POSE_SD = 1.0
#: The fit has converged when the predicted gain of a step is below this; a residual of
#: one standard deviation costs 1.
GAIN_TOLERANCE = 1e-4
#: Most steps; the fit takes about ten.
_MAX_STEPS = 100


class SizeFit(NamedTuple):
    """The fitted body."""

    log_sizes: Array  # (S,) of each segment's factor, in the order of `SEGMENTS`
    positions: Array  # (M, 3) markers in their link's frame, m
    q: Array  # (25,) pose in the static trial
    covariance: Array  # (S, S) of the log sizes
    converged: bool  # whether the fit met its tolerance


def fit_sizes(generic: Skeleton, target: Array, *, known: bool = False) -> SizeFit:
    """Gauss-Newton with step halving over sizes, marker places and pose.

    The generic body has the markers at their nominal places; the target is their mean
    positions in the world (M, 3), m; NaN where never seen. `known` says that the body
    is the person's, so that sizes stay.
    """
    places = np.asarray(target, dtype=np.float64).tobytes()
    return _fit_sizes(generic.urdf, generic.marker_set, places, known)


@lru_cache(maxsize=1)
def _fit_sizes(urdf: str, worn: MarkerSet, places: bytes, known: bool) -> SizeFit:
    """Do so once: scaling and the fit to explorations start from the same one."""
    from scipy.linalg import cho_factor, cho_solve  # takes a while to load

    generic, target = Skeleton(urdf, worn), np.frombuffer(places).reshape(-1, 3)
    seen = seen_markers(target)
    weight = np.linalg.cholesky(np.linalg.inv(size_covariance(known=known))).T
    placement = np.array([m.placement_sd for m in worn.markers])
    fixed = generic.columns(worn.held)
    free = np.setdiff1d(np.arange(generic.nv), fixed)
    n_sizes, n_markers, n_joints = len(SEGMENTS), len(placement), generic.nv - 6

    q = MarkerIK(generic.with_markers(worn.all_tracked())).solve(target).q
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
        sized = generic.resized(size_factors(sizes))
        places = sized.marker_positions + offsets
        return sized, sized.with_markers(worn.at(places))

    sized, placed = body(sizes, offsets)
    positions, by_pose = placed.marker_jacobian(q)
    errors = residual(sizes, offsets, q, positions)
    converged = False
    for _ in range(_MAX_STEPS):
        by_size, by_place = sized.size_jacobian(q)
        J = _assemble(by_size, by_place, by_pose, seen, weight, placement, free)
        step = cho_solve(cho_factor(J.T @ J), -J.T @ errors)
        # The gain that the linear model predicts, in squared standard deviations.
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
            sized, placed = body(trial[0], trial[1])
            positions, by_pose = placed.marker_jacobian(trial[2])
            trial_errors = residual(*trial, positions)
            if trial_errors @ trial_errors <= errors @ errors * (1 + 1e-12):
                break
            length /= 2
        sizes, offsets, q = trial
        errors = trial_errors
    by_size, by_place = sized.size_jacobian(q)
    J = _assemble(by_size, by_place, by_pose, seen, weight, placement, free)
    covariance = cho_solve(cho_factor(J.T @ J), np.eye(J.shape[1], n_sizes))[:n_sizes]
    found = sizes, sized.marker_positions + offsets, q, covariance
    for array in found:
        array.flags.writeable = False
    return SizeFit(*found, converged)


def _assemble(
    by_size: Array,
    by_place: Array,
    by_pose: Array,
    seen: Mask,
    weight: Array,
    placement: Array,
    free: Indices,
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


def size_covariance(*, known: bool = False) -> Array:
    """Return the prior covariance of the segments' log factors, (S, S).

    Between people; or, of a person whose sizes are known, next to nothing.
    """
    if known:
        return KNOWN_SD**2 * np.eye(len(SEGMENTS))
    kinds = [name.split("_", 1)[-1] if name != "thorax" else name for name in SEGMENTS]
    same = np.array([[a == b for b in kinds] for a in kinds])
    kind_sd = np.array([SEGMENT_SD[kind] for kind in kinds])
    return (
        STATURE_SD**2
        + same * np.outer(kind_sd, kind_sd)
        + SIDE_SD**2 * np.eye(len(kinds))
    )


def size_factors(log_sizes: Array) -> dict[str, float]:
    """Size factor of each segment from the logs (S,) of all, by its name."""
    return dict(zip(SEGMENTS, np.exp(log_sizes).tolist(), strict=True))


def length_deviations(
    lengths: Mapping[str, float], covariance: Array
) -> dict[str, float]:
    """Return each length's standard deviation, m, given the log sizes' covariance."""
    sd = dict(zip(SEGMENTS, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return {name: length * sd[name] for name, length in lengths.items()}
