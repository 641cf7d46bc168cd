"""The gate for a robot's recording: which samples show its null space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.skeleton import Robot
from ikns.errors import NotEnoughData

__all__ = ["robot_null_space_samples"]


def robot_null_space_samples(
    robot: Robot, time: ArrayLike, q: ArrayLike, *, max_hand_speed: float = 0.05
) -> tuple[Array, Array]:
    """Positions of a robot's frame and joint vectors while the frame is held.

    As :func:`ikns.nullspace.map.null_space_samples` for a person.

    Parameters
    ----------
    robot : Robot
    time : (T,) array
        s, increasing.
    q : (T, n) array
        Joint positions, rad.
    max_hand_speed : float
        A frame slower than this counts as held, m/s.

    Returns
    -------
    x : (N, 3) array
        Positions of the frame in the base, m.
    q : (N, n) array
        Joint vectors there, rad.

    Raises
    ------
    NotEnoughData
        When the frame is never held.
    """
    angles = np.asarray(q, dtype=np.float64)
    place, _ = robot.pose(angles)
    velocity = np.gradient(place, np.asarray(time, dtype=np.float64), axis=0)
    held = np.linalg.norm(velocity, axis=1) < max_hand_speed
    if not held.any():
        raise NotEnoughData(
            f"expected samples with '{robot.frame}' slower than {max_hand_speed:g} "
            "m/s, found none."
        )
    return place[held], angles[held]
