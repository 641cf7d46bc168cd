"""Kinematics of a body at any posture, and how much its self-motions are curved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.numerics.subspace import mean_null_direction, principal_angles

#: Half a step along Z for the derivative of the hand's pose, rad: its error is of the
#: order of the step squared (1e-10 m/rad), that of rounding 1e-16 m over the step.
_STEP = 1e-5
#: Share of the samples that represents one end of the range.
_END = 0.05


@dataclass(frozen=True)
class Kinematics:
    """Where a hand is, and how joints move it, at postures that were not visited.

    Parameters
    ----------
    pose : callable
        From joint vectors (..., n) to positions (..., 3) m and orientations
        (..., 3, 3).
    jacobian : callable
        From joint vectors (..., n) to Jacobians (..., k, n) of the task.
    """

    pose: Callable[[Array], tuple[Array, Array]]
    jacobian: Callable[[Array], Array]


def hand_rates(
    kinematics: Kinematics | None, mean: Array, Z: Array, jacobian: Array
) -> Array:
    """Hand velocity, m/rad, and turn rate, rad/rad, along each direction, (d, 2, 3).

    Differentiated at the mean posture where there are kinematics. Else from the
    Jacobian: unless it has 3 or 6 rows the rates are NaN, and with 3 the turn rate is.
    """
    rates = np.full((len(Z), 2, 3), np.nan)
    if kinematics is not None:
        x, R = kinematics.pose(mean + _STEP * np.stack([Z, -Z]))
        rates[:, 0] = (x[0] - x[1]) / (2 * _STEP)
        turned = Rotation.from_matrix(R[0]) * Rotation.from_matrix(R[1]).inv()
        rates[:, 1] = turned.as_rotvec() / (2 * _STEP)
    elif len(jacobian) in (3, 6):
        known = (jacobian @ Z.T).T.reshape(len(Z), -1, 3)
        rates[:, : known.shape[1]] = known
    return rates


def null_turn(c: Array, jacobians: Array, null_dim: int) -> float:
    """Angle between the null spaces at both ends of the range of c, rad.

    The largest principal angle between the null spaces averaged over the 5 % of the
    samples with the smallest c and over the 5 % with the largest; c (N,), Jacobians (N,
    k, n).
    """
    if not np.ptp(c) > 0:
        return float("nan")
    low, high = np.quantile(c, [_END, 1 - _END])
    ends = [
        mean_null_direction(jacobians[rows], null_dim)[0]
        for rows in (c <= low, c >= high)
    ]
    return float(principal_angles(*ends).max())


def straight_departure(
    kinematics: Kinematics | None, mean: Array, Z: Array, lower: Array, upper: Array
) -> tuple[float, float]:
    """Deviation of the hand when the joints move straight along Z to its ends.

    At the worst end, m and rad, from the mean posture; NaN without kinematics.
    """
    if kinematics is None:
        return float("nan"), float("nan")
    now = Z @ mean
    steps = np.concatenate([lower - now, upper - now])
    ends = mean + steps[:, None] * np.concatenate([Z, Z])
    place, rotation = kinematics.pose(mean)
    places, rotations = kinematics.pose(ends)
    away = np.linalg.norm(places - place, axis=1)
    turned = Rotation.from_matrix(rotations) * Rotation.from_matrix(rotation).inv()
    return float(away.max()), float(turned.magnitude().max())
