"""How good an answer is, whoever gave it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik import LIMIT
from peers.problem import ACCURACY, Problem, coordinates

__all__ = ["Answer", "OwnCost", "judge", "to_own_minimum"]

Array = NDArray[np.float64]

#: The exact minimum is reached when a step moves nothing by this, rad and m; at most so
#: many steps (joints that markers barely show converge slowly).
_STILL, _STEPS = 1e-8, 200


@dataclass(frozen=True)
class OwnCost:
    """What a solver minimizes beside the squared marker distances.

    Parameters
    ----------
    pull : float
        Weight of the distance to the pose before, m/rad.
    trunk : bool
        Whether the trunk is pulled too.
    limits : bool
        Whether joint limits are soft walls of stiffness
        :data:`ikns.motion.marker_ik.LIMIT`.
    """

    pull: float = 0.0
    trunk: bool = True
    limits: bool = False


@dataclass(frozen=True)
class Answer:
    """One solver's answer to all frames.

    Parameters
    ----------
    cost : (T,) array
        Sum of the squared distances of the seen markers, m^2.
    seen : (T,) array
        Markers seen.
    rest : (T,) array
        OpenSim's stopping test in units of its accuracy: it stops below 1.
    error : (T, 18) array
        Joint angles less the truth, within half a turn, rad.
    """

    cost: Array
    seen: Array
    rest: Array
    error: Array

    @property
    def distance(self) -> Array:
        """Root mean square marker distance of each frame, m."""
        return np.sqrt(self.cost / self.seen)


def judge(problem: Problem, q: Array) -> Answer:
    """Measure an answer (T, 25).

    Simbody's L-BFGS minimizes f = cost / (2 seen) and stops when, for each coordinate
    x, ``|df/dx| max(1, |x|) / max(0.1, f) <= accuracy`` (SimTKmath, lbfgs.cpp).
    """
    cost, seen, rest = (np.empty(len(q)) for _ in range(3))
    for i, (pose, frame) in enumerate(zip(q, problem.markers, strict=True)):
        rows = np.isfinite(frame[:, 0])
        places, jacobian = problem.skeleton.marker_jacobian(pose)
        away = (places - frame)[rows]
        cost[i], seen[i] = np.sum(away**2), rows.sum()
        gradient = np.einsum("mk,mkj->j", away, jacobian[rows]) / seen[i]
        # The tangent has place before orientation, the coordinates the reverse.
        x = np.roll(coordinates(pose)[:6], 3), coordinates(pose)[6:]
        scale = np.maximum(1, np.abs(np.concatenate(x)))
        goal = max(0.1, cost[i] / (2 * seen[i]))
        rest[i] = np.max(np.abs(gradient) * scale) / goal / ACCURACY
    turned = q[:, 7:] - problem.truth[:, 7:]
    return Answer(cost, seen, rest, (turned + np.pi) % (2 * np.pi) - np.pi)


def to_own_minimum(problem: Problem, q: Array, own: OwnCost, rows: Array) -> Array:
    """Largest joint angle between answers and the minimum next to them, rad."""
    return np.array(
        [
            np.abs(
                _minimum(problem.skeleton, problem.markers[i], q[i], q[i - 1], own)[7:]
                - q[i, 7:]
            ).max()
            for i in rows
        ]
    )


def _minimum(
    skeleton: Skeleton, frame: Array, q: Array, before: Array, own: OwnCost
) -> Array:
    """Gauss-Newton from `q`, steps halved until the cost falls; unseen joints stay."""
    rows, n = np.isfinite(frame[:, 0]), skeleton.nv
    pull = np.full(n, own.pull)
    pull[:6] *= own.trunk

    def errors(q: Array) -> tuple[Array, Array]:
        places, jacobian = skeleton.marker_jacobian(q)
        outside = np.zeros(n)
        outside[6:] = q[7:] - np.clip(q[7:], skeleton.lower, skeleton.upper)
        wall = own.limits * LIMIT * (outside != 0)
        moved = skeleton.difference(before, q)
        away = (places - frame)[rows].ravel()
        J = np.vstack([jacobian[rows].reshape(-1, n), np.diag(pull), np.diag(wall)])
        return np.concatenate([away, pull * moved, wall * outside]), J

    error, J = errors(q)
    for _ in range(_STEPS):
        # Singular values below 1e-6 m/rad: a radian would move no marker by 1 um.
        cut = 1e-6 / np.linalg.norm(J, 2)
        step = -np.linalg.lstsq(J, error, rcond=cut)[0]
        step /= max(1.0, np.abs(step).max())
        while np.abs(step).max() > _STILL:
            trial = skeleton.integrate(q, step)
            error_there, J_there = errors(trial)
            if error_there @ error_there < error @ error:
                break
            step /= 2
        else:
            break
        q, error, J = trial, error_there, J_there
    return q
