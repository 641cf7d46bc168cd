"""Marker inverse kinematics: the joint angles that put markers where they were seen.

Each frame minimizes, over the configuration q,

    sum over seen markers weight_m |p_m(q) - seen_m|^2         marker distances, m^2
    + (PRIOR |q - q_before|)^2                        weak pull to the pose before
    + (LIMIT max(0, lower - q, q - upper))^2          soft joint limits

A marker that was not seen weighs nothing. What no marker shows stays where it was, so
that there is a pose in every frame; the motion says what of it is known.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.body.chains import SIDES, ChainLike
from ikns.body.set_choice import too_few_of_set
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, MarkerMismatch, NotEnoughData, naming
from ikns.motion.ends import with_ends
from ikns.motion.marker_ik.kernel import KernelSolver
from ikns.motion.marker_ik.pose import (
    MAX_ITERATIONS,
    STEP_TOLERANCE,
    Pose,
    SolvedFrames,
)
from ikns.motion.marker_ik.rejection import recorded_reasons
from ikns.motion.marker_ik.visibility import (
    Visibility,
    require_sight,
    seen_markers,
    visible_segments,
)
from ikns.motion.motion import Motion, all_seen, believed_joints
from ikns.numerics.derivative import slope
from ikns.numerics.rigid import pose_steps
from ikns.recording.recording import Recording

#: Frames between two reports of progress: milliseconds.
_CHUNK = 500
#: For so long frames start from the last pose whose markers fit, s; live the finger
#: goes to its safe state after the same time.
PATIENCE = 0.5


class MarkerIK:
    """Solve for joint angles, frame by frame, each starting from the one before.

    Parameters
    ----------
    skeleton : Skeleton
        Body and markers; static-only markers have no weight.
    max_iterations : int
        Steps per frame.
    tolerance : float
        A frame has converged when no joint moves more than this in a step, rad and m.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, n_points=1, rate=25, quick=True
    ... )
    >>> motion = MarkerIK(run.subject.skeleton).track(run.static.recording)
    >>> bool((motion.residual < 0.005).all())
    True
    """

    def __init__(
        self,
        skeleton: Skeleton,
        *,
        max_iterations: int = MAX_ITERATIONS,
        tolerance: float = STEP_TOLERANCE,
    ) -> None:
        if max_iterations < 1 or not tolerance > 0:
            raise InvalidInput(
                "expected at least one iteration and a tolerance above 0, found "
                f"{max_iterations} and {tolerance:g}."
            )
        self.skeleton = skeleton
        self.max_iterations = max_iterations
        self.tolerance = tolerance
        self.held = skeleton.marker_set.held
        worn = skeleton.marker_set.markers
        self._tracked = np.array([not marker.static_only for marker in worn])
        self._markers_shape = (len(worn), 3)
        self._pose_shape = (7 + len(skeleton.joint_names),)
        self.solver = KernelSolver(
            skeleton, max_iterations=max_iterations, tolerance=tolerance
        )

    def solve(self, markers: ArrayLike, q: Array | None = None) -> Pose:
        """Solve one frame.

        Parameters
        ----------
        markers : (M, 3) array
            Positions in the world (m) in the order of the skeleton's marker set; NaN
            where not seen.
        q : (nq,) array, optional
            The pose before; without it the solver starts from scratch.

        Returns
        -------
        Pose
            Without any visible marker, the pose before; residual NaN, not converged.
        """
        seen = np.asarray(markers, dtype=np.float64)
        if seen.shape != self._markers_shape:
            raise InvalidInput(
                f"expected markers {self._markers_shape}, found {seen.shape}."
            )
        if q is not None:
            q = np.asarray(q, dtype=np.float64)
            if q.shape != self._pose_shape:
                raise InvalidInput(
                    f"expected a pose {self._pose_shape}, found {q.shape}."
                )
        pose = self.solver.solve_one(seen, q)
        if pose.iterations < 0:
            raise InvalidInput(
                "marker positions must be finite or NaN, found infinity."
            )
        if pose.residual == np.inf:
            if q is None or np.isfinite(q).all():
                farthest = np.nanmax(np.abs(seen))
                raise InvalidInput(
                    f"expected markers of a person, found one {farthest:.2g} m away."
                )
            raise InvalidInput("the pose before must be finite, found NaN or infinity.")
        return pose

    def track(
        self,
        recording: Recording,
        *,
        chain: ChainLike | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Motion:
        """Solve a whole recording.

        Parameters
        ----------
        recording : Recording
            Any recording that holds at least three of the skeleton's markers.
        chain : str, optional
            What the recording is meant to show, see :class:`ikns.Chain`.
            Without it an arm that is never visible is just unknown in every frame.
        progress : callable, optional
            Called with (frames done, frames in total).

        Returns
        -------
        Motion
            NaN where a frame does not show a joint or a hand, by the rule of
            :func:`ikns.motion.marker_ik.visibility.visible_segments`, and of arms whose
            markers cannot be right, by the live loop's gate
            (:class:`ikns.motion.marker_ik.gate.GateLimits`); `q` alone is a pose in
            every frame.

        Raises
        ------
        MarkerMismatch
            When fewer than three of the skeleton's markers are in the recording, or a
            segment of `chain`, or the thorax, is never visible.
        NotEnoughData
            When `chain` is asked for and there are fewer than two frames.
        """
        marker_set = self.skeleton.marker_set
        with naming(recording.source):
            found = marker_set.columns(recording.labels) >= 0
        known = found & self._tracked
        if known.sum() < 3:
            raise MarkerMismatch(
                too_few_of_set(
                    recording.source, marker_set, recording.labels, calibrated=True
                )
            )
        markers = np.ascontiguousarray(
            marker_set.pick(recording.labels, recording.markers), dtype=np.float64
        )
        n = len(markers)
        visibility = visible_segments(self.skeleton, markers)
        if chain is not None:
            with naming(recording.source):
                if n < 2:
                    raise NotEnoughData(
                        f"expected at least 2 frames, as one shows no speed, found {n}."
                    )
                require_sight(self.skeleton, visibility, chain, recording.labels)
        # Start where most markers are seen, then go both ways.
        visible = seen_markers(markers)[:, self._tracked].sum(axis=1)
        start = int(np.argmax(visible))
        rows = self.solver.new_rows(n)
        # A single frame has no rate.
        patience = round(PATIENCE * recording.rate) if n > 1 else 0
        first = self.solver.new_memory()
        self.solver.solve(
            markers,
            (start, start + 1, 1),
            None,
            rows,
            patience=patience,
            memory=first,
        )
        done = 1
        for begin, end, way in ((start + 1, n, 1), (start - 1, -1, -1)):
            memory = first.copy()
            for at in range(begin, end, way * _CHUNK):
                stop = min(at + _CHUNK, n) if way == 1 else max(at - _CHUNK, -1)
                self.solver.solve(
                    markers,
                    (at, stop, way),
                    memory[-self._pose_shape[0] :],
                    rows,
                    patience=patience,
                    memory=memory,
                )
                done += abs(stop - at)
                if progress is not None:
                    progress(done, n)
        frames = SolvedFrames.of(rows)
        rejected, reasons = recorded_reasons(
            self.skeleton, self.solver.gate, markers, frames, recording.rate
        )
        motion = self._motion(recording.time, frames, visibility, rejected, reasons)
        return motion if chain is None else with_ends(self.skeleton, motion, chain)

    def _motion(
        self,
        time: Array,
        frames: SolvedFrames,
        visibility: Visibility,
        rejected: Indices,
        reasons: tuple[str, ...],
    ) -> Motion:
        """Add hands, and velocities by :func:`ikns.numerics.derivative.slope`."""
        skeleton, q = self.skeleton, frames.q
        segments, seen, known = visibility
        known = known & believed_joints(skeleton.joint_names, rejected)
        position, rotation = skeleton.hands_in_thorax(q)
        steps = np.zeros((len(q), skeleton.nv))
        steps[1:] = np.hstack([pose_steps(q[:, :7]), np.diff(q[:, 7:], axis=0)])
        # What stays where it was, as nothing shows it, has no velocity of its own.
        root = np.tile(all_seen(segments, seen)[:, None], skeleton.nv - known.shape[1])
        arms = np.stack([all_seen(segments, seen, side) for side in SIDES], axis=1)
        shown = np.broadcast_to((arms & (rejected < 0))[..., None], position.shape)
        return Motion(
            time=np.array(time),
            q=q,
            v=slope(np.cumsum(steps, axis=0), time, np.hstack([root, known])),
            joint_names=skeleton.joint_names,
            hand_in_thorax=position,
            hand_rotation_in_thorax=rotation,
            hand_velocity_in_thorax=slope(position, time, shown),
            residual=frames.residual,
            iterations=frames.iterations,
            converged=frames.converged,
            held=self.held,
            segments=segments,
            seen=seen,
            known=known,
            rejected=rejected,
            reasons=reasons,
        )
