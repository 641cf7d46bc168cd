"""From a motion and a skeleton, or a robot's recording, to plain arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.analysis.compare.change_coordinates import change_coordinates
from ikns.analysis.compare.coordinates import shoulder_coordinates
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.reaching import Crosstalk, crosstalk
from ikns.analysis.compare.samples import NullSpaceComparison, compare_samples
from ikns.analysis.compare.subspaces import learned_directions
from ikns.body.chains import SIDES, chain_joints, chain_sides
from ikns.body.skeleton import Robot, Skeleton
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap, still_mask

__all__ = ["compare_motion", "compare_robot", "motion_crosstalk"]

Array = NDArray[np.float64]

_SHOULDER = ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation")


def compare_motion(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    motion: Motion,
    *,
    chain: str = "right_arm",
    analyzed: str | None = None,
    task: Literal["pose", "position"] = "pose",
    coordinates: str = "internal",
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
    **options: Any,
) -> NullSpaceComparison:
    """Compare a learned map with the null spaces of a person's arm.

    Parameters
    ----------
    learned : NullSpaceMap
        In internal coordinates of `chain`.
    skeleton : Skeleton
        Owner of the Jacobian.
    motion : Motion
        What the arm did; its still samples near each PCA point are compared.
    chain : str
        Joints of the map, see :data:`ikns.body.chains.CHAINS`.
    analyzed : str, optional
        Another chain of the same hands, with or without the clavicle. Then directions
        and ranges are learned again from the same samples of its joints, signs as in
        the map: a map of seven joints cannot know what the other two did.
    task : {"pose", "position"}
        What is held: hand position and orientation, or position alone.
    coordinates : str
        Of the shoulder, see :mod:`ikns.analysis.compare.coordinates`. In others than
        ``"internal"`` directions are learned again too; rotation vectors start from the
        mean posture of all samples.
    max_hand_speed, min_duration : float
        See :func:`ikns.nullspace.map.still_mask`, m/s and s.
    **options
        Of :func:`ikns.analysis.compare.compare_samples`.

    Returns
    -------
    NullSpaceComparison
        Its `points` are those of the map that were visited; others are left out. Of two
        hands the leak is that of the point between them and of the right one's
        orientation.

    Raises
    ------
    InvalidInput
        When the chains have different hands, or see :func:`compare_samples`.
    NotEnoughData
        When no point has enough still samples, or see :func:`compare_samples`.
    """
    whole = chain if analyzed is None else analyzed
    if chain_sides(whole) != chain_sides(chain):
        raise InvalidInput(
            f"expected a chain that ends in the {' and '.join(chain_sides(chain))} "
            f"hand as the map's {chain} does, found {whole}."
        )
    if learned.directions_.shape[2] != len(chain_joints(chain)):
        raise InvalidInput(
            f"expected a map of {chain} with {len(chain_joints(chain))} joints, found "
            f"one of {learned.directions_.shape[2]}."
        )
    gate = still_mask(
        motion, chain, max_hand_speed=max_hand_speed, min_duration=min_duration
    )
    gate &= np.isfinite(motion.chain_angles(whole)).all(axis=1)
    x, angles = motion.task_position(chain)[gate], motion.angles[gate]
    q = motion.chain_angles(whole)[gate]
    if not len(x):
        raise NotEnoughData(
            f"expected samples with the hand slower than {max_hand_speed:g} m/s, found "
            "none."
        )
    labels, points = _visited(learned, x, q.shape[1])
    names = chain_joints(whole)
    columns = [motion.joint_names.index(name) for name in names]
    sides = [SIDES.index(side) for side in chain_sides(whole)]

    def kinematics(point: int) -> Kinematics:
        rest = angles[labels == point].mean(axis=0)

        def posture(given: Array) -> Array:
            full = np.broadcast_to(rest, (*given.shape[:-1], len(rest))).copy()
            full[..., columns] = given
            return full

        def pose(given: Array) -> tuple[Array, Array]:
            place, turn = skeleton.hands_in_thorax(posture(given))
            return place[..., sides, :].mean(axis=-2), turn[..., sides[0], :, :]

        return Kinematics(
            pose, lambda y: skeleton.chain_jacobian(posture(y), whole, task=task)
        )

    reference = _embedded(learned.directions_[points], chain_joints(chain), names)
    return _compared(
        motion.time[gate],
        q,
        skeleton.chain_jacobian(angles, whole, task=task),
        x,
        motion.hand_rotation_in_thorax[gate][:, sides[0]],
        labels,
        points,
        reference,
        (learned.lower_[points], learned.upper_[points]),
        [kinematics(k) for k in range(len(points))],
        shoulders=_shoulders(names),
        coordinates=coordinates,
        again=whole != chain,
        variance=learned.variance,
        options=options,
    )


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

    Parameters
    ----------
    learned : NullSpaceMap
        Of all the robot's joints.
    robot : Robot
    time : (T,) array
        s, increasing.
    q : (T, n) array
        Joint angles, rad.
    task : {"pose", "position"}
        What is held.
    max_hand_speed : float
        Gate on the frame's speed, m/s.
    **options
        Of :func:`ikns.analysis.compare.compare_samples`.

    Raises
    ------
    InvalidInput, NotEnoughData
        As :func:`compare_motion`.
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
    gate = np.isfinite(x).all(axis=1) & (speed < max_hand_speed)
    if not gate.any():
        raise NotEnoughData(
            f"expected samples with the hand slower than {max_hand_speed:g} m/s, found "
            "none."
        )
    labels, points = _visited(learned, x[gate], n)
    return _compared(
        t[gate],
        angles[gate],
        robot.jacobian(angles[gate], task=task),
        x[gate],
        R[gate],
        labels,
        points,
        learned.directions_[points],
        (learned.lower_[points], learned.upper_[points]),
        [Kinematics(robot.pose, lambda y: robot.jacobian(y, task=task))] * len(points),
        shoulders=[],
        coordinates="internal",
        again=False,
        variance=learned.variance,
        options=options,
    )


def motion_crosstalk(
    learned: NullSpaceMap,
    motion: Motion,
    *,
    chain: str = "right_arm",
    max_hand_speed: float = 0.05,
    **options: Any,
) -> Crosstalk:
    """Measure how a person's reaches change the (first) control signal.

    Parameters
    ----------
    learned : NullSpaceMap
    motion : Motion
        With natural reaches.
    chain : str
        Joints of the map.
    max_hand_speed : float
        Gate between reach and rest, m/s.
    **options
        Of :func:`ikns.analysis.compare.crosstalk`.
    """
    c = learned.control_signal(motion.chain_angles(chain), motion.task_position(chain))
    return crosstalk(
        c if c.ndim == 1 else c[:, 0],
        motion.hand_speed(chain),
        motion.task_position(chain),
        max_hand_speed=max_hand_speed,
        **options,
    )


def _visited(
    learned: NullSpaceMap, x: Array, n: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Label samples by the points that have enough of them; and those points."""
    radius = getattr(learned, "radius_", None)
    near, _ = nearest_center(x, learned.centers_, radius=radius)
    counts = np.bincount(near[near >= 0], minlength=len(learned.centers_))
    points = np.flatnonzero(counts >= 2 * n)
    if not points.size:
        raise NotEnoughData(
            f"expected {2 * n} still samples or more near a PCA point, found "
            f"{counts.max()}."
        )
    number = np.full(len(counts) + 1, -1)  # the last stands for none
    number[points] = np.arange(len(points))
    return number[near], points


def _embedded(Z: Array, own: Sequence[str], names: Sequence[str]) -> Array:
    """Directions of some joints among others; zero for those they do not know."""
    found = np.zeros((*Z.shape[:2], len(names)))
    for i, name in enumerate(names):
        if name in own:
            found[..., i] = Z[..., list(own).index(name)]
    return found


def _shoulders(names: Sequence[str]) -> list[list[int]]:
    """Columns of each shoulder."""
    return [
        [list(names).index(f"{side}_{joint}") for joint in _SHOULDER]
        for side in SIDES
        if f"{side}_{_SHOULDER[0]}" in names
    ]


def _compared(
    time: Array,
    q: Array,
    jacobians: Array,
    position: Array,
    rotation: Array,
    labels: NDArray[np.int64],
    points: NDArray[np.int64],
    directions: Array,
    ranges: tuple[Array, Array],
    kinematics: list[Kinematics],
    *,
    shoulders: list[list[int]],
    coordinates: str,
    again: bool,
    variance: float,
    options: dict[str, Any],
) -> NullSpaceComparison:
    used = labels >= 0
    if coordinates != "internal":
        again = True
        for columns in shoulders:
            middle = q[used][:, columns].mean(axis=0)
            there = shoulder_coordinates(coordinates, middle)
            q, jacobians, directions, kinematics = change_coordinates(
                there, columns, labels, q, jacobians, directions, kinematics
            )
    lower, upper = ranges
    if again:
        rows = [q[labels == k] for k in range(len(points))]
        directions = np.stack(
            [
                learned_directions(own, Z, variance=variance)
                for own, Z in zip(rows, directions, strict=True)
            ]
        )
        along = [own @ Z.T for own, Z in zip(rows, directions, strict=True)]
        lower = np.stack([c.min(axis=0) for c in along])
        upper = np.stack([c.max(axis=0) for c in along])
    found = compare_samples(
        time[used],
        q[used],
        jacobians[used],
        position[used],
        rotation[used],
        labels[used],
        directions,
        lower,
        upper,
        kinematics=kinematics,
        variance=variance,
        **options,
    )
    return dataclasses.replace(found, points=points)
