"""Segment lengths from a static trial and many frames of the exploration together.

Lengths from a static trial are as accurate as the placement of the markers. Frames in
which joints turn determine the joint centers, wherever the markers are. The cost over
log sizes s, marker offsets o and the posture of every frame is

    the cost of :func:`ikns.calibration.scaling.scale`          static trial, priors
    + sum over F frames and markers |p_m(q_k, s, o) - seen|^2 / marker_sd^2 * N / F

Skin moves with the posture, so errors are correlated between frames: N is the number of
frames with independent errors that the F frames are worth. The default of 1 takes them
as one; with N = F, skin motion of 6 mm makes lengths worse than a static trial alone.

A length is observable only as far as the joints at its ends turn; where they do not, an
offset of all markers along the segment explains the same frames, and the result stays
with the static trial and the prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS, relative_sizes
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import ScalingReport, scale
from ikns.calibration.size_fit import (
    MARKER_SD,
    POSE_SD,
    length_deviations,
    size_factors,
)
from ikns.calibration.static_trial import static_posture
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.recording import Recording
from ikns.symbolic.length_program import FrameData, LengthProgram, Solution

#: Fewer frames than this are refused.
MIN_FRAMES = 10
#: The spread of the markers is estimated from the solution and the fit repeated: at
#: most so many times, until it changes by less than this share.
_ROUNDS, _SETTLED = 3, 0.05
#: No camera places a marker better than this, m.
_LEAST_SD = 1e-4


@dataclass(frozen=True, eq=False)
class LengthFit:
    """Result of the joint fit, with that of the static trial alone.

    Parameters
    ----------
    lengths, length_sd : dict
        Joint-to-joint length of each segment and its standard deviation under the
        assumptions of the fit, m.
    static_lengths, static_length_sd : dict
        The same from :func:`ikns.calibration.scaling.scale`.
    marker_sd : float
        Error of a marker of weight 1 in the moving frames, m per axis: given, or as
        measured.
    frames : int
        Moving frames in use.
    offsets : dict
        How far each marker sits from its nominal place, m.
    solved, status, iterations
        Whether the optimizer met its tolerance, and its report of the last solution.
    """

    lengths: dict[str, float]
    length_sd: dict[str, float]
    static_lengths: dict[str, float]
    static_length_sd: dict[str, float]
    marker_sd: float
    frames: int
    offsets: dict[str, float]
    solved: bool
    status: str
    iterations: int


def fit_lengths(
    generic: Skeleton,
    static: Recording,
    recordings: Sequence[Recording],
    *,
    marker_set: str | Path | MarkerSet | None = None,
    n_frames: int = 60,
    independent_frames: float = 1.0,
    marker_sd: float | None = None,
    min_duration: float = 1.0,
) -> tuple[Skeleton, LengthFit]:
    """Fit the generic skeleton to a static trial and an exploration.

    Parameters
    ----------
    generic, static, marker_set, min_duration
        As :func:`ikns.calibration.scaling.scale` takes them.
    recordings : sequence of Recording
        The exploration, from which frames far apart in joint angles are chosen, among
        those that show most markers.
    n_frames : int
        Number of frames in total, at least 10.
    independent_frames : float
        Number of frames with independent errors that they are worth; `n_frames` for
        markers that do not move relative to the bone.
    marker_sd : float, optional
        Error of a marker of weight 1 in a moving frame, m per axis. Default: estimated
        by the fit.

    Returns
    -------
    skeleton : Skeleton
        A new skeleton with the markers that :func:`ikns.scale` keeps.
    report : LengthFit

    Raises
    ------
    InvalidInput
        When `n_frames`, `independent_frames` or `marker_sd` is out of its range.
    NotEnoughData
        When the static trial is too short, or fewer than 10 frames are usable.
    MarkerMismatch
        When a recording lacks markers.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> static, points = run.static.recording, run.points.recording
    >>> skeleton, report = fit_lengths(Skeleton.load(), static, [points], n_frames=10)
    >>> report.solved, report.frames
    (True, 10)
    """
    if n_frames < MIN_FRAMES:
        raise InvalidInput(f"expected at least {MIN_FRAMES} frames, found {n_frames}.")
    if marker_sd is not None and not 0 < marker_sd < np.inf:
        raise InvalidInput(f"expected a marker_sd above 0 m, found {marker_sd:g}.")
    if not 0 < independent_frames < np.inf:
        raise InvalidInput(
            f"expected independent_frames above 0, found {independent_frames:g}."
        )
    scaled, before = scale(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    reference, target, _ = static_posture(
        generic, static, marker_set=marker_set, min_duration=min_duration
    )
    worn = reference.marker_set
    q, markers = _chosen(scaled, recordings, n_frames)
    # Skin with a turn of its own is where no joint has it.
    markers[:, [marker.free_turn for marker in scaled.marker_set.markers]] = np.nan
    first = MarkerIK(reference.with_markers(worn.all_tracked())).solve(target)
    seen = np.asarray(np.isfinite(markers).all(axis=2))
    worth = min(independent_frames / len(q), 1.0)
    pulls = np.r_[1.0, np.full(len(q), worth)] / POSE_SD**2

    kept = scaled.marker_set.labels
    tracked = [m for m, label in enumerate(worn.labels) if label in kept]
    trust = np.zeros((len(q), len(worn.markers)))
    trust[:, tracked] = seen * [worn.markers[m].weight for m in tracked]
    every = np.full((len(q), len(worn.markers), 3), np.nan)
    every[:, tracked] = markers
    in_static = np.isfinite(target).all(axis=1) / MARKER_SD**2

    sizes = np.log(list(_sizes(scaled, reference).values()))
    offsets = np.zeros((len(worn.markers), 3))
    nominal = reference.resized(size_factors(sizes)).marker_positions
    offsets[tracked] = scaled.marker_positions - nominal[tracked]
    program = LengthProgram(reference, len(q) + 1)
    sd = marker_sd or _spread(scaled, q, markers)
    q = np.vstack([first.q, q])
    for _ in range(_ROUNDS):
        frames = FrameData(
            q=q,
            markers=np.concatenate([target[None], every]),
            weights=np.vstack([in_static, worth * trust / sd**2]),
            pulls=pulls,
        )
        found = program.solve(frames, sizes, offsets)
        sizes, offsets, q = found.log_sizes, found.offsets, found.q
        if marker_sd is not None or not found.solved:
            break
        # Unknowns: 24 numbers per frame, and the shared ones.
        freedom = 3 * seen.sum() - 24 * len(seen) - 3 * len(tracked) - len(sizes)
        after = float(np.sqrt(np.sum(trust * found.squares[1:]) / max(freedom, 1)))
        after = max(after, _LEAST_SD)
        if abs(after - sd) < _SETTLED * sd:
            break
        sd = after
    sized = reference.resized(size_factors(sizes))
    places = sized.marker_positions + offsets
    skeleton = sized.with_markers(worn.at(places).only(kept))
    return skeleton, _report(skeleton, worn, found, before, sd, len(trust))


def _report(
    skeleton: Skeleton,
    worn: MarkerSet,
    found: Solution,
    before: ScalingReport,
    marker_sd: float,
    frames: int,
) -> LengthFit:
    lengths = skeleton.segment_lengths
    distance = np.linalg.norm(found.offsets, axis=1)
    return LengthFit(
        lengths=lengths,
        length_sd=length_deviations(lengths, found.covariance),
        static_lengths=before.lengths,
        static_length_sd=before.length_sd,
        marker_sd=marker_sd,
        frames=frames,
        offsets=dict(zip(worn.labels, distance.tolist(), strict=True)),
        solved=found.solved,
        status=found.status,
        iterations=found.iterations,
    )


def _chosen(
    skeleton: Skeleton, recordings: Sequence[Recording], n: int
) -> tuple[Array, Array]:
    """Postures (F, nq) far apart and their markers (F, M, 3) m, as cameras saw them."""
    solver, worn = MarkerIK(skeleton), skeleton.marker_set
    q, markers = [], []
    for recording in recordings:
        motion = solver.track(recording)
        good = motion.converged & np.isfinite(motion.q).all(axis=1)
        q.append(motion.q[good])
        markers.append(worn.pick(recording.labels, recording.markers)[good])
    names = ", ".join(recording.source for recording in recordings) or "no recording"
    q_all = np.concatenate(q) if q else np.empty((0, 25))
    if len(q_all) < MIN_FRAMES:
        raise NotEnoughData(
            f"{names}: expected at least {MIN_FRAMES} frames with known joints, found "
            f"{len(q_all)}."
        )
    seen = np.concatenate(markers)
    count = np.isfinite(seen).all(axis=2).sum(axis=1)
    # As many markers as enough frames show.
    enough = np.sort(count)[::-1][min(n, len(count)) - 1]
    rows = np.flatnonzero(count >= enough)
    rows = rows[_far_apart(q_all[rows, 7:], n)]
    return q_all[rows], seen[rows]


def _far_apart(points: Array, n: int) -> NDArray[np.int64]:
    """Farthest-point sampling of rows, starting with the one nearest the mean."""
    at = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())]
    nearest = np.linalg.norm(points - points[at[0]], axis=1)
    while len(at) < min(n, len(points)):
        at.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[at[-1]], axis=1))
    return np.array(at)


def _spread(skeleton: Skeleton, q: Array, markers: Array) -> float:
    """Error of a marker around the scaled body, m per axis."""
    model = skeleton.markers_in_world(q)
    weight = [marker.weight for marker in skeleton.marker_set.markers]
    squares = weight * np.sum((model - markers) ** 2, axis=2)
    known = np.isfinite(squares)
    freedom = 3 * known.sum() - 24 * len(q)
    return max(float(np.sqrt(np.sum(squares[known]) / max(freedom, 1))), _LEAST_SD)


def _sizes(skeleton: Skeleton, reference: Skeleton) -> dict[str, float]:
    sizes = relative_sizes(skeleton.urdf, reference.urdf)
    return {name: sizes[name] for name in SEGMENTS}
