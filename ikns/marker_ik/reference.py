"""Marker inverse kinematics: the joint angles that put markers where they were seen.

Each frame minimizes, over the configuration q,

    sum over seen markers weight_m |p_m(q) - seen_m|^2         marker distances, m^2
    + (PRIOR |q - q_before|)^2                        weak pull to the pose before
    + (LIMIT max(0, lower - q, q - upper))^2          soft joint limits

by Levenberg-Marquardt (More 1978) with Pinocchio's Jacobians. A marker that was not
seen weighs nothing; what no marker shows stays where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from ikns.derivative import slope
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.motion import SIDES, Motion
from ikns.recording import Recording
from ikns.rigid import rigid_transform
from ikns.skeleton import Skeleton

__all__ = ["MarkerIK", "Pose", "motion_from_poses"]

Array = NDArray[np.float64]

#: Pull towards the pose before, m/rad and m/m: the ratio of marker noise (1 mm) to
#: what a joint typically turns within a frame (5 rad/s at 100 Hz is 0.05 rad). A joint
#: with markers 50 mm from its axis lags by (0.02 / 0.05)^2 = 16 % of a frame, one with
#: 200 mm by 1 %; what markers barely show no longer jitters.
PRIOR = 2e-2
#: The same from scratch, where the start is a guess: it only settles unseen joints.
PRIOR_FROM_SCRATCH = 5e-4
#: Stiffness of the joint limits, m/rad: 10 deg beyond a limit costs as much as 9 mm.
LIMIT = 0.05
#: A frame has converged when no joint moves more than this in a step, rad and m.
STEP_TOLERANCE = 1e-5
#: Root mean square residual above which a frame is also tried from scratch, m. Soft
#: tissue and modeling leave 10 to 20 mm (stoop lifts, see benchmarks/real_people.py).
LOST = 0.06
#: Arm poses to start from when nothing is known: hanging, forearm forward, reaching
#: forward, reaching sideways, hand at the mouth, hand overhead; rad.
_STARTS: tuple[dict[str, float], ...] = (
    {},
    {"elbow_flexion": 1.4},
    {"shoulder_flexion": 1.2, "elbow_flexion": 0.4},
    {"shoulder_abduction": 1.4, "elbow_flexion": 0.3},
    {"shoulder_flexion": 0.9, "shoulder_rotation": 0.5, "elbow_flexion": 2.2},
    {"shoulder_abduction": 2.2, "elbow_flexion": 0.8},
)


@dataclass(frozen=True, eq=False)
class Pose:
    """One solved frame.

    Parameters
    ----------
    q : (nq,) array
        Configuration.
    residual : float
        Root mean square marker distance over the seen markers, m; NaN without any.
    iterations : int
        Steps tried.
    converged : bool
        Whether the last step met the tolerance.
    """

    q: Array
    residual: float
    iterations: int
    converged: bool


class MarkerIK:
    """Solve for joint angles, frame by frame, each starting from the one before.

    Parameters
    ----------
    skeleton : Skeleton
        Body and markers; static-only markers weigh nothing.
    max_iterations : int
        Levenberg-Marquardt steps per frame.
    """

    def __init__(self, skeleton: Skeleton, *, max_iterations: int = 50) -> None:
        self.skeleton = skeleton
        self.max_iterations = max_iterations
        self.held = skeleton.marker_set.held
        fixed = skeleton.columns(self.held)
        self._free = np.setdiff1d(np.arange(skeleton.nv), fixed)
        worn = skeleton.marker_set.markers
        self._tracked = np.array([not marker.static_only for marker in worn])
        self._weight = np.sqrt([marker.weight for marker in worn])

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
            With every marker gone it is the pose before, residual NaN, not converged.
        """
        seen = np.array(markers, dtype=np.float64)
        expected = (len(self._tracked), 3)
        if seen.shape != expected:
            raise InvalidInput(f"expected markers {expected}, found {seen.shape}.")
        if np.isinf(seen).any():
            raise InvalidInput(
                "marker positions must be finite or NaN, found infinity."
            )
        if q is not None and not np.isfinite(q).all():
            raise InvalidInput("the pose before must be finite, found NaN or infinity.")
        seen[~self._tracked] = np.nan
        if not np.isfinite(seen).all(axis=1).any():
            start = self.skeleton.neutral() if q is None else q
            return Pose(start, float("nan"), 0, False)
        if q is None:
            return self._from_scratch(seen)
        pose = self._descend(seen, q)
        if pose.residual > LOST:
            again = self._from_scratch(seen)
            pose = again if again.residual < pose.residual else pose
        return pose

    def track(
        self,
        recording: Recording,
        *,
        progress: Callable[[int, int], None] | None = None,
    ) -> Motion:
        """Solve a whole recording.

        Parameters
        ----------
        recording : Recording
            Any recording that holds at least three of the skeleton's markers.
        progress : callable, optional
            Called with (frames done, frames in all).

        Raises
        ------
        MarkerMismatch
            When fewer than three of the skeleton's markers are in the recording.
        """
        marker_set = self.skeleton.marker_set
        known = (marker_set.columns(recording.labels) >= 0) & self._tracked
        if known.sum() < 3:
            raise MarkerMismatch(
                f"{recording.source}: expected markers of {marker_set.name} "
                f"({', '.join(marker_set.labels[:4])}, ...), found "
                f"{', '.join(recording.labels[:4])}, ...; name the right marker set."
            )
        markers = marker_set.pick(recording.labels, recording.markers)
        n, done = len(markers), 1
        # Start where most markers are seen, then go both ways.
        visible = np.isfinite(markers[:, self._tracked]).all(axis=2).sum(axis=1)
        start = int(np.argmax(visible))
        first = self.solve(markers[start])
        poses = [first] * n
        for way in (range(start + 1, n), range(start - 1, -1, -1)):
            before = first
            for i in way:
                poses[i] = before = self.solve(markers[i], before.q)
                done += 1
                if progress is not None and (done % 100 == 0 or done == n):
                    progress(done, n)
        return motion_from_poses(self.skeleton, recording.time, poses)

    def _from_scratch(self, seen: Array) -> Pose:
        """Try several arm poses, then join each side's best."""
        skeleton = self.skeleton
        finite = np.isfinite(seen).all(axis=1)
        solved = []
        for start in _STARTS:
            q = skeleton.neutral()
            for joint, angle in start.items():
                for side in SIDES:
                    q[7 + skeleton.joint_names.index(f"{side}_{joint}")] = angle
            model = skeleton.markers_in_world(q)
            if finite.sum() >= 3:
                rotation, shift = rigid_transform(model[finite], seen[finite])
                q[:3], q[3:7] = shift, Rotation.from_matrix(rotation).as_quat()
            solved.append(self._descend(seen, q, prior=False))
        best = min(solved, key=lambda pose: pose.residual)
        joined = best.q.copy()
        links = np.array([marker.link for marker in skeleton.marker_set.markers])
        for side in SIDES:
            own = finite & np.char.startswith(links, side)
            if own.any():
                errors = [
                    np.sum((skeleton.markers_in_world(p.q)[own] - seen[own]) ** 2)
                    for p in solved
                ]
                columns = 7 + np.flatnonzero(
                    np.char.startswith(skeleton.joint_names, side)
                )
                joined[columns] = solved[int(np.argmin(errors))].q[columns]
        final = self._descend(seen, joined, prior=False)
        return final if final.residual <= best.residual else best

    def _descend(self, seen: Array, before: Array, *, prior: bool = True) -> Pose:
        """Levenberg-Marquardt from the pose `before`."""
        skeleton, free = self.skeleton, self._free
        rows = np.isfinite(seen).all(axis=1)
        target, weight = seen[rows], self._weight[rows, None]
        pull = PRIOR if prior else PRIOR_FROM_SCRATCH
        q, damping = before, 1e-8
        positions, jacobian = skeleton.marker_jacobian(q)
        cost = self._cost(weight * (positions[rows] - target), before, q, pull)
        converged = False
        iterations = 0
        while iterations < self.max_iterations:
            error = (weight * (positions[rows] - target)).ravel()
            J = weight[:, None] * jacobian[rows][:, :, free]
            J = J.reshape(len(error), len(free))
            moved = skeleton.difference(before, q)[free]
            beyond, outside = self._beyond(q)
            diagonal = pull**2 + LIMIT**2 * outside[free]
            hessian = J.T @ J
            gradient = J.T @ error + pull**2 * moved + LIMIT**2 * beyond[free]
            accepted = False
            while not accepted and iterations < self.max_iterations:
                iterations += 1
                # Damping in proportion to the diagonal (More), so that meters and
                # radians are treated alike.
                damped = hessian.copy()
                scale = hessian.diagonal() + diagonal
                damped.flat[:: len(free) + 1] = scale * (1 + damping) + 1e-14
                try:
                    step = cho_solve(
                        cho_factor(damped, check_finite=False),
                        -gradient,
                        check_finite=False,
                    )
                except LinAlgError:
                    damping = max(10 * damping, 1e-6)
                    continue
                full = np.zeros(skeleton.nv)
                full[free] = step
                # A step of more than a radian is beyond what the linear model knows.
                full /= max(1.0, np.abs(full).max())
                trial = skeleton.integrate(q, full)
                trial_positions, trial_jacobian = skeleton.marker_jacobian(trial)
                error = weight * (trial_positions[rows] - target)
                trial_cost = self._cost(error, before, trial, pull)
                small = np.abs(full).max() < STEP_TOLERANCE
                if trial_cost <= cost:
                    q, cost = trial, trial_cost
                    positions, jacobian = trial_positions, trial_jacobian
                    damping = max(damping / 10, 1e-12)
                    accepted = True
                else:
                    damping = max(10 * damping, 1e-6)
                if small:
                    converged = True
                    break
            if converged:
                break
        distance = np.linalg.norm(positions[rows] - target, axis=1)
        return Pose(q, float(np.sqrt(np.mean(distance**2))), iterations, converged)

    def _cost(self, error: Array, before: Array, q: Array, pull: float) -> float:
        moved = self.skeleton.difference(before, q)
        beyond, _ = self._beyond(q)
        return float(
            np.sum(error**2) + pull**2 * (moved @ moved) + LIMIT**2 * (beyond @ beyond)
        )

    def _beyond(self, q: Array) -> tuple[Array, Array]:
        """How far each joint is beyond its limit (signed), and whether it is."""
        skeleton = self.skeleton
        angles = q[-len(skeleton.joint_names) :]
        beyond = np.zeros(skeleton.nv)
        beyond[-len(angles) :] = np.maximum(angles - skeleton.upper, 0) + np.minimum(
            angles - skeleton.lower, 0
        )
        return beyond, (beyond != 0).astype(np.float64)


def motion_from_poses(skeleton: Skeleton, time: Array, poses: Sequence[Pose]) -> Motion:
    """Add hands, and velocities by :func:`ikns.derivative.slope`, to solved frames."""
    q = np.stack([pose.q for pose in poses])
    hands = [skeleton.hands_in_thorax(row) for row in q]
    hand_in_thorax = np.stack([position for position, _ in hands])
    steps = np.zeros((len(q), skeleton.nv))
    for i in range(1, len(q)):
        steps[i] = skeleton.difference(q[i - 1], q[i])
    return Motion(
        time=np.array(time),
        q=q,
        v=slope(np.cumsum(steps, axis=0), time),
        joint_names=skeleton.joint_names,
        hand_in_thorax=hand_in_thorax,
        hand_rotation_in_thorax=np.stack([rotation for _, rotation in hands]),
        hand_velocity_in_thorax=slope(hand_in_thorax, time),
        residual=np.array([pose.residual for pose in poses]),
        iterations=np.array([pose.iterations for pose in poses]),
        converged=np.array([pose.converged for pose in poses]),
        held=skeleton.marker_set.held,
    )
