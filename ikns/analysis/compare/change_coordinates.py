"""Samples, Jacobians, directions and kinematics in other shoulder coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.coordinates import Coordinates
from ikns.analysis.compare.kinematics import Kinematics

__all__ = ["change_coordinates"]

Array = NDArray[np.float64]


def change_coordinates(
    there: Coordinates,
    columns: list[int],
    labels: NDArray[np.int64],
    q: Array,
    jacobians: Array,
    directions: Array,
    kinematics: list[Kinematics],
) -> tuple[Array, Array, Array, list[Kinematics]]:
    """Write one shoulder in other coordinates; arguments are left as they are.

    Parameters
    ----------
    there : Coordinates
    columns : list of 3 int
        The shoulder's joints.
    labels : (N,) integer array
        PCA point of each sample, -1 for none.
    q, jacobians, directions, kinematics
        As for :func:`ikns.analysis.compare.compare_samples`, in internal angles.

    Returns
    -------
    q : (N, n) array
        Without jumps of a full turn among the samples of a point.
    jacobians : (N, k, n) array
        By the chain rule.
    directions : (P, d, n) array
        By the rates at each point's mean posture; unit length, not orthogonal.
    kinematics : list of Kinematics
    """
    turned = np.array(directions)
    for k in range(len(turned)):
        B = there.rates(q[labels == k][:, columns].mean(axis=0))
        turned[k][:, columns] = np.linalg.solve(B, turned[k][:, columns].T).T
    turned /= np.linalg.norm(turned, axis=2, keepdims=True)
    J, y = np.array(jacobians), np.array(q)
    J[:, :, columns] = J[:, :, columns] @ there.rates(q[:, columns])
    y[:, columns] = _unwrapped(there.from_internal(q[:, columns]), labels)
    return y, J, turned, [_seen_in(there, columns, own) for own in kinematics]


def _seen_in(there: Coordinates, columns: list[int], own: Kinematics) -> Kinematics:
    """Kinematics that takes joint vectors in other coordinates."""

    def internal(y: Array) -> Array:
        q = np.array(y)
        q[..., columns] = there.to_internal(q[..., columns])
        return q

    def jacobian(y: Array) -> Array:
        q = internal(y)
        J = np.array(own.jacobian(q))
        J[..., columns] = J[..., columns] @ there.rates(q[..., columns])
        return J

    return Kinematics(lambda y: own.pose(internal(y)), jacobian)


def _unwrapped(y: Array, labels: NDArray[np.int64]) -> Array:
    """Angles without jumps of a full turn among the samples of a point."""
    smooth = np.array(y)
    for k in np.unique(labels):
        rows = y[labels == k]
        middle = np.angle(np.exp(1j * rows).mean(axis=0))
        smooth[labels == k] = middle + np.angle(np.exp(1j * (rows - middle)))
    return smooth
