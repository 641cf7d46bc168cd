"""Curvature: a self-motion is a curve, its direction Z a straight line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.analysis.compare.kinematics import Kinematics
from ikns.numerics.subspace import mean_null_direction, principal_angles

__all__ = ["null_turn", "straight_departure"]

Array = NDArray[np.float64]

#: Share of the samples that represents one end of the range.
_END = 0.05


def null_turn(c: Array, jacobians: Array, null_dim: int) -> float:
    """Angle between the null spaces at both ends of the range of c, rad.

    Parameters
    ----------
    c : (N,) array
        Control signal.
    jacobians : (N, k, n) array
        One a sample.
    null_dim : int
        Dimensions of the null space.

    Returns
    -------
    float
        Largest principal angle between the null spaces averaged over the 5 % of the
        samples with the smallest c and over the 5 % with the largest.
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

    Parameters
    ----------
    kinematics : Kinematics, optional
    mean : (n,) array
        Mean posture, where the lines start, rad.
    Z : (d, n) array
        Directions.
    lower, upper : (d,) array
        m and M, rad.

    Returns
    -------
    (float, float)
        At the worst end: m and rad; NaN without kinematics.
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
