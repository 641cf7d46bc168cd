"""A robot that explores its null space, as a person does at a PCA point: simulated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput
from ikns.simulation.wander import wander

__all__ = ["explore_null_space", "reach_pose"]

Array = NDArray[np.float64]

#: Pose error at which Newton stops, m and rad: far above rounding, far below what
#: anybody measures.
_TOLERANCE = 1e-10
#: A step of the joints is this share of the way to where they are drawn: what is drawn
#: wanders slowly, so the lag of some samples does no harm, and a start away from it
#: makes no jump.
_FOLLOW = 0.1
#: A Newton step moves no joint further than this, rad, and there are so many at most.
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
    """Move the joints at random while the frame stays where it is.

    The joints are drawn to a posture that wanders about `q`. Only the part of that pull
    that lies in the null space of the Jacobian is followed, and Newton's method then
    puts the frame back exactly.

    Parameters
    ----------
    robot : Robot
    q : (n,) array
        Where to start, rad.
    seconds, rate : float
        How long, and samples per second.
    spread : float
        Standard deviation of what the joints are drawn to, rad a joint.
    cutoff : float
        How fast that wanders, Hz.
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
        When `q` is not a posture within the limits, or nothing is free to move there.
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
    drawn = start + wander(rng, samples, n, sd=spread, cutoff=cutoff, rate=rate)
    visited = np.empty((samples, n))
    current = start
    for i in range(samples):
        basis = robot.null_spaces(current, task=task)[0]
        step = _FOLLOW * basis.T @ (basis @ (drawn[i] - current))
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
    """Posture near `q` that puts the frame at a pose, by Newton's method.

    Each step is the shortest that the Jacobian allows, so the null space is left alone.
    Limits are not looked at.

    Parameters
    ----------
    robot : Robot
    q : (n,) array
        Where to start, rad.
    position : (3,) array
        Seen from the base, m.
    rotation : (3, 3) array
        Not looked at for the task ``"position"``.
    task : {"pose", "position"}

    Returns
    -------
    (n,) array

    Raises
    ------
    InvalidInput
        When the pose is out of reach from there.
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
