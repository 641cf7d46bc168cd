"""Curvature: a self-motion is a curve, its direction Z a straight line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.numerics.subspace import mean_null_direction, principal_angles

__all__ = ["null_turn", "straight_departure"]

Array = NDArray[np.float64]

#: Share of the samples that stands for one end of the range.
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
        Largest principal angle between the null spaces averaged over the twentieth of
        the samples with the least c and over that with the most.
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
    place: tuple[Array, Array], ends: tuple[Array, Array]
) -> tuple[float, float]:
    """How far the hand strays when the joints go straight along Z to its ends.

    Parameters
    ----------
    place : ((3,) array, (3, 3) array)
        Hand position, m, and orientation at the mean posture.
    ends : ((E, 3) array, (E, 3, 3) array)
        The same at the ends of the straight lines.

    Returns
    -------
    (float, float)
        At the worst end: m and rad.
    """
    away = np.linalg.norm(ends[0] - place[0], axis=1)
    turned = Rotation.from_matrix(ends[1]) * Rotation.from_matrix(place[1]).inv()
    return float(away.max()), float(turned.magnitude().max())
