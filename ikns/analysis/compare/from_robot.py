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
from ikns.nullspace.map import NullSpaceMap


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
        Joint angles, rad.
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
    x, R = robot.pose(angles)
    speed = np.linalg.norm(np.gradient(x, t, axis=0), axis=1)
    still = np.flatnonzero(np.isfinite(x).all(axis=1) & (speed < max_hand_speed))
    labels, points = visited_points(learned, x[still], n, max_hand_speed=max_hand_speed)
    used = still[labels >= 0]

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
