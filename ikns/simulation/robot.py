"""A simulated robot that explores its null space, as a person does at a PCA point."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput
from ikns.simulation.wander import wander

#: Pose error at which Newton's method stops, m and rad: far above rounding, far below
#: what can be measured.
_TOLERANCE = 1e-10
#: Share of the distance to the attracting posture that the joints cover per sample. The
#: posture drifts slowly, so the lag does no harm, and a distant start makes no jump.
_FOLLOW = 0.1
#: Largest change of a joint in a Newton step, rad, and largest number of steps.
_LONGEST_STEP, _ITERATIONS = 0.3, 100


def explore_null_space(
    robot: Robot,
    q: ArrayLike,
    *,
    seconds: float = 5.0,
    rate: float = 100.0,
    spread: float = 0.5,
    cutoff: float = 0.5,
    task: str = "pose",
    seed: int | np.random.Generator,
) -> tuple[Array, Array]:
    """Move the joints at random while the frame is held.

    An attracting posture drifts about `q`. The joints follow it in the null space of
    the Jacobian only, and Newton's method then restores the frame exactly.

    Parameters
    ----------
    robot : Robot
    q : (n,) array
        Initial posture, rad.
    seconds, rate : float
        Duration, and samples per second.
    spread : float
        Standard deviation of the attracting posture, rad per joint.
    cutoff : float
        Cut-off frequency of its drift, Hz.
    task : {"pose", "position"}
        What is held.
    seed : int or numpy.random.Generator

    Returns
    -------
    time : (T,) array
        Seconds.
    q : (T, n) array
        Within the limits of the joints, rad.

    Raises
    ------
    InvalidInput
        When `q` is not a posture within the limits, or has no null space.
    """
    start = np.array(q, dtype=np.float64)
    n = len(robot.joint_names)
    if (
        start.shape != (n,)
        or not ((start >= robot.lower) & (start <= robot.upper)).all()
    ):
        raise InvalidInput(
            f"expected a posture ({n},) within the limits of the joints, found "
            f"{start.tolist()}."
        )
    if not len(robot.null_spaces(start, task=task)[0]):
        raise InvalidInput(
            f"expected joints that can move while the {task} of '{robot.frame}' is "
            f"held, but {n} joints leave no null space."
        )
    target = robot.pose(start)
    samples = max(2, round(seconds * rate))
    rng = np.random.default_rng(seed)
    attractor = start + wander(rng, samples, n, sd=spread, cutoff=cutoff, rate=rate)
    visited = np.empty((samples, n))
    current = start
    for i in range(samples):
        basis = robot.null_spaces(current, task=task)[0]
        step = _FOLLOW * basis.T @ (basis @ (attractor[i] - current))
        moved = reach_pose(robot, current + step, *target, task=task)
        if ((moved >= robot.lower) & (moved <= robot.upper)).all():
            current = moved
        visited[i] = current
    return np.arange(samples) / rate, visited


def reach_pose(
    robot: Robot,
    q: ArrayLike,
    position: ArrayLike,
    rotation: ArrayLike,
    *,
    task: str = "pose",
) -> Array:
    """Return a posture (n,) near `q` that puts the frame at a pose, by Newton's method.

    Steps have minimum norm, so they do not move in the null space. Joint limits are
    ignored.

    Parameters
    ----------
    robot : Robot
    q : (n,) array
        Initial posture, rad.
    position, rotation : (3,) and (3, 3) array
        In the base frame, m; the rotation is ignored for the task ``"position"``.
    task : {"pose", "position"}

    Raises
    ------
    InvalidInput
        When the pose cannot be reached from `q`.
    """
    joints, place = np.array(q, dtype=np.float64), np.array(position, dtype=np.float64)
    for _ in range(_ITERATIONS):
        here, turned = robot.pose(joints)
        error = place - here
        if task == "pose":
            turn = Rotation.from_matrix(np.asarray(rotation) @ turned.T).as_rotvec()
            error = np.concatenate([error, turn])
        if np.abs(error).max() < _TOLERANCE:
            return joints
        step = np.linalg.pinv(robot.jacobian(joints, task=task)) @ error
        joints += step * min(1.0, _LONGEST_STEP / np.abs(step).max())
    raise InvalidInput(
        f"'{robot.frame}' cannot reach {place.round(3).tolist()} m from there."
    )
