"""Kinematics of a body at any posture: where its hand is and how joints move it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["Kinematics", "hand_rates"]

Array = NDArray[np.float64]

#: Half a step along Z for the derivative of the hand's pose, rad: its error is of the
#: order of the step squared (1e-10 m/rad), that of rounding 1e-16 m over the step.
_STEP = 1e-5


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

    Parameters
    ----------
    kinematics : Kinematics, optional
        Differentiated at the mean posture where there is one.
    mean : (n,) array
        Mean posture, rad.
    Z : (d, n) array
        Directions.
    jacobian : (k, n) array
        Used without kinematics; unless it has 3 or 6 rows the rates are NaN, and with 3
        the turn rate is.
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
