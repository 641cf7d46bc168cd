"""Compare a map learned from a robot's recording with the robot's null spaces."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.map_samples import (
    MapSamples,
    compare_map_samples,
    visited_points,
)
from ikns.analysis.compare.samples import NullSpaceComparison
from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap, held_angles, held_frame
from ikns.numerics.turns import nearest_turn


def compare_robot(
    learned: NullSpaceMap,
    robot: Robot,
    time: ArrayLike,
    q: ArrayLike,
    *,
    task: Literal["pose", "position"] = "pose",
    max_hand_speed: float = 0.05,
    **options: Any,
) -> NullSpaceComparison:
    """Compare a map learned from a robot's joint angles with its null spaces.

    As :func:`compare_motion`, for a map of all the robot's joints.

    Parameters
    ----------
    learned, robot, task, options
    time : (T,) array
        s, increasing.
    q : (T, n) array
        Joint angles, rad; a full turn more or less is the same posture.
    max_hand_speed : float
        Gate on the frame's speed, m/s.
    """
    t, angles = (np.asarray(given, dtype=np.float64) for given in (time, q))
    n = len(robot.joint_names)
    if angles.shape != (len(t), n) or learned.directions_.shape[2] != n:
        raise InvalidInput(
            f"expected joint angles (T, {n}) and a map of {n} joints, found "
            f"{angles.shape} and {learned.directions_.shape[2]}."
        )
    x, held = held_frame(robot, t, angles, max_hand_speed=max_hand_speed)
    R = robot.pose(angles)[1]
    angles = held_angles(robot, angles, held)
    still = np.flatnonzero(held)
    labels, points = visited_points(learned, x[still], n, max_hand_speed=max_hand_speed)
    used = still[labels >= 0]
    means: Any = getattr(learned, "cluster_means_", None)
    for k, point in enumerate(points if means is not None else ()):
        # The same turn as in the recording that the map was learned from.
        rows = np.ix_(still[labels == k], np.flatnonzero(robot.endless))
        mean = angles[rows].mean(axis=0)
        angles[rows] += nearest_turn(mean, means[point, robot.endless]) - mean

    def jacobian(q: Any) -> Any:
        return robot.jacobian(q, task=task)

    samples = MapSamples(
        time=t[used],
        q=angles[used],
        jacobians=jacobian(angles[used]),
        position=x[used],
        rotation=R[used],
        labels=labels[labels >= 0],
        directions=learned.directions_[points],
        lower=learned.lower_[points],
        upper=learned.upper_[points],
        kinematics=[Kinematics(robot.pose, jacobian)] * len(points),
    )
    return compare_map_samples(
        samples, points, variance=learned.variance, options=options
    )


def free_tasks(robot: Robot, q: ArrayLike) -> tuple[Literal["pose", "position"], ...]:
    """Tasks of a robot that leave a null space at joint positions (T, n), rad or m.

    Redundant in the pose, a robot is so in the position too.

    Raises
    ------
    InvalidInput
        When there is none.
    """
    n = len(robot.joint_names)
    tasks: tuple[Literal["pose", "position"], ...] = ("pose", "position")
    found = tuple(t for t in tasks if robot.null_spaces(q, task=t)[1].max() < n)
    if not found:
        raise InvalidInput(
            f"expected joints that can move while '{robot.frame}' is held, but the {n} "
            f"joints from the base to it ({', '.join(robot.joint_names)}) leave no "
            "null space, not even of its position."
        )
    return found
