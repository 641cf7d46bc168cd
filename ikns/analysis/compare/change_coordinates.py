"""Samples, Jacobians, directions and kinematics in other shoulder coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.coordinates import Coordinates, shoulder_coordinates
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.map_samples import MapSamples

__all__ = ["change_coordinates"]

Array = NDArray[np.float64]


def change_coordinates(
    samples: MapSamples, name: str, columns: list[int]
) -> MapSamples:
    """Write one shoulder in other coordinates.

    Parameters
    ----------
    samples : MapSamples
        In internal angles.
    name : str
        One of :data:`ikns.analysis.compare.COORDINATES`; a rotation vector starts from
        the mean posture of all samples.
    columns : list of 3 int
        The shoulder's joints.

    Returns
    -------
    MapSamples
        `q` without jumps of a full turn among the samples of a point; `jacobians` by
        the chain rule; `directions` by the rates at each point's mean posture, of unit
        length but not orthogonal. Ranges are those of the internal angles.
    """
    q, labels = samples.q, samples.labels
    there = shoulder_coordinates(name, q[:, columns].mean(axis=0))
    Z = np.array(samples.directions)
    for k in range(len(Z)):
        B = there.rates(q[labels == k][:, columns].mean(axis=0))
        Z[k][:, columns] = np.linalg.solve(B, Z[k][:, columns].T).T
    Z /= np.linalg.norm(Z, axis=2, keepdims=True)
    J, y = np.array(samples.jacobians), np.array(q)
    J[:, :, columns] = J[:, :, columns] @ there.rates(q[:, columns])
    y[:, columns] = _unwrapped(there.from_internal(q[:, columns]), labels)
    return samples._replace(
        q=y,
        jacobians=J,
        directions=Z,
        kinematics=[_in_coordinates(there, columns, own) for own in samples.kinematics],
    )


def _in_coordinates(
    there: Coordinates, columns: list[int], own: Kinematics
) -> Kinematics:
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
