"""Marker inverse kinematics written plainly: what the compiled one is checked against.

Levenberg-Marquardt (More 1978) with Pinocchio's Jacobians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.pose import (
    LIMIT,
    LOST,
    MAX_ITERATIONS,
    PRIOR,
    PRIOR_FROM_SCRATCH,
    STEP_TOLERANCE,
    Pose,
    starting_poses,
)
from ikns.numerics.rigid import rigid_transform

Array = NDArray[np.float64]


class PlainMarkerIK:
    """Solve frames for one skeleton; the arguments are those of `MarkerIK`."""

    def __init__(
        self,
        skeleton: Skeleton,
        *,
        max_iterations: int = MAX_ITERATIONS,
        tolerance: float = STEP_TOLERANCE,
    ) -> None:
        self.skeleton = skeleton
        self.max_iterations = max_iterations
        self.tolerance = tolerance
        fixed = skeleton.columns(skeleton.marker_set.held)
        self._free = np.setdiff1d(np.arange(skeleton.nv), fixed)
        worn = skeleton.marker_set.markers
        self._tracked = np.array([not marker.static_only for marker in worn])
        self._weight = np.sqrt([marker.weight for marker in worn])

    def solve(self, markers: Array, q: Array | None = None) -> Pose:
        """Solve one frame of markers (M, 3); NaN where not seen."""
        seen = markers.copy()
        seen[~self._tracked] = np.nan
        if not np.isfinite(seen).all(axis=1).any():
            start = self.skeleton.neutral() if q is None else np.array(q)
            return Pose(start, float("nan"), 0, False)
        if q is None:
            return self._from_scratch(seen)
        pose = self._descend(seen, q)
        if pose.residual > LOST:
            again = self._from_scratch(seen)
            pose = again if again.residual < pose.residual else pose
        return pose

    def _from_scratch(self, seen: Array) -> Pose:
        """Try several arm poses, then join each side's best."""
        skeleton = self.skeleton
        finite = np.isfinite(seen).all(axis=1)
        solved = []
        for q in starting_poses(skeleton):
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
            moved = _displacement(before, q)[free]
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
                small = np.abs(full).max() < self.tolerance
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
        moved = _displacement(before, q)
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


def _displacement(before: Array, q: Array) -> Array:
    """How far `q` is from `before`: the thorax's shift and turn, the joints' angles.

    The shift is seen from the thorax at `q`, so that this is half the gradient of its
    own square.
    """
    now, then = Rotation.from_quat(q[3:7]), Rotation.from_quat(before[3:7])
    turn = (then.inv() * now).as_rotvec()
    return np.concatenate([now.inv().apply(q[:3] - before[:3]), turn, (q - before)[7:]])
