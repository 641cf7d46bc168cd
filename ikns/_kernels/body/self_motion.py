"""Follow the self-motion of an arm: the elbow swivels, the hand stays where it is."""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.body.elbow import write_swivels
from ikns._kernels.body.paths import Paths, write_jacobians
from ikns._kernels.body.reach import reach_pose
from ikns._kernels.compiled import compiled
from ikns._kernels.row_space import write_bases
from ikns.arrays import Array, Indices

#: How far the arm is moved to see which way the elbow swivels, rad.
_TRY = 1e-4
#: Relative size of singular values that count as zero.
_RTOL = 1e-9


@compiled
def follow_self_motion(
    hand: Paths,
    elbows: Paths,
    side: int,
    columns: Indices,
    limits: Array,
    goal: tuple[Array, Array],
    sign: float,
    ends: tuple[float, float],
    girdle: tuple[float, float, float],
    steps: tuple[float, float, float, float],
    start: Array,
    swivels: Array,
    postures: Array,
) -> int:
    """Write swivels (K,), rad, and postures (K, 9) in one direction; return how many.

    Parameters
    ----------
    hand, elbows : Paths
        To the hand, with the Jacobian's columns in the order of the seven joints; and
        of both elbows, see :func:`ikns._kernels.body.elbow.write_swivels`.
    side : int
        Of the arm, 0 for the right one.
    columns : (9,) integer array
        Of the arm's angles, the clavicle's two first.
    limits : (2, 9) array
        Lowest and highest angle at which the motion ends, rad; not the clavicle's.
    goal : (3,) array, (3, 3) array
        Pose of the hand in the thorax, m.
    sign : float
        1 upwards, -1 downwards.
    ends : float, float
        Swivels at which it ends, rad.
    girdle : float, float, float
        Rest of the clavicle's angles, and how far they follow the upper arm, rad.
    steps : float, float, float, float
        Length of a step, rad; tolerance and longest step of
        :func:`ikns._kernels.body.reach.reach_pose`; shortest change of the swivel that
        counts, rad.
    start : (18,) array
        Angles of the body.
    swivels, postures : (K,) and (K, 9) array
        With room for all.

    Returns
    -------
    int
        Number of postures; -1 where the hand cannot be kept, -2 without room.
    """
    stride, tolerance, longest, shortest = steps
    seven = columns[2:]
    current = start.copy().reshape(1, -1)
    jacobian, basis = np.zeros((1, 6, 7)), np.empty((1, 1, 7))
    rank, swivel = np.empty(1, np.int64), np.empty((1, 2))
    ahead = np.zeros(7)
    write_swivels(elbows, current, swivel)
    at, count = swivel[0, side], 0
    while ends[0] < at < ends[1]:
        write_jacobians(hand, current, 6, jacobian)
        write_bases(jacobian, _RTOL, False, basis, rank)
        along = 0.0
        if count == 0:
            moved = current.copy()
            for j in range(7):
                moved[0, seven[j]] += _TRY * basis[0, 0, j]
            write_swivels(elbows, moved, swivel)
            along = sign * (swivel[0, side] - at)
        else:
            for j in range(7):
                along += basis[0, 0, j] * ahead[j]
        turn = 1.0 if along > 0 else -1.0 if along < 0 else 0.0
        for j in range(7):
            ahead[j] = turn * basis[0, 0, j]
            current[0, seven[j]] += stride * ahead[j]
        abduction, flexion = current[0, seven[0]], current[0, seven[1]]
        current[0, columns[0]] = girdle[0] + girdle[2] * math.sin(flexion)
        current[0, columns[1]] = girdle[1] + girdle[2] * (
            1.0 - math.cos(abduction) * math.cos(flexion)
        )
        if not reach_pose(
            hand, seven, goal[0], goal[1], tolerance, longest, current[0]
        ):
            return -1
        before = at
        write_swivels(elbows, current, swivel)
        at = swivel[0, side]
        # A swivel that is NaN has not changed by enough either.
        if not sign * (at - before) >= shortest:
            return count
        for j in range(2, 9):
            angle = current[0, columns[j]]
            if angle < limits[0, j] or angle > limits[1, j]:
                return count
        if count == len(swivels):
            return -2
        swivels[count] = at
        for j in range(9):
            postures[count, j] = current[0, columns[j]]
        count += 1
    return count
