"""Still samples near the points of a map, as arrays to compare."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.coordinates import Coordinates, shoulder_coordinates
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.samples import NullSpaceComparison, compare_samples
from ikns.analysis.compare.subspaces import learned_directions
from ikns.arrays import Array
from ikns.errors import NotEnoughData
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap


class MapSamples(NamedTuple):
    """Samples of P points of a map; fields as :func:`compare_samples` takes them."""

    time: Array
    q: Array
    jacobians: Array
    position: Array
    rotation: Array
    labels: NDArray[np.int64]
    directions: Array
    lower: Array
    upper: Array
    kinematics: list[Kinematics]


def visited_points(
    learned: NullSpaceMap, x: Array, n: int, *, max_hand_speed: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Label samples by the P points of a map that have enough of them.

    `x` (N, 3) are the hand positions of the still samples; a point needs 2 n, for n
    joints. Returns which of the visited points each belongs to, from 0, -1 for none;
    and the numbers (P,) of these points in the map, from 0.
    """
    if not len(x):
        raise NotEnoughData(
            f"expected samples with the hand slower than {max_hand_speed:g} m/s, found "
            "none."
        )
    radius = getattr(learned, "radius_", None)
    near, _ = nearest_center(x, learned.centers_, radius=radius)
    counts = np.bincount(near[near >= 0], minlength=len(learned.centers_))
    points = np.flatnonzero(counts >= 2 * n)
    if not points.size:
        raise NotEnoughData(
            f"expected {2 * n} still samples or more near a PCA point, found "
            f"{counts.max()}."
        )
    number = np.full(len(counts) + 1, -1)  # the last is for samples without a point
    number[points] = np.arange(len(points))
    return number[near], points


def learn_again(samples: MapSamples, *, variance: float) -> MapSamples:
    """Learn directions and ranges from the samples, signs as in the given directions.

    `variance` as in :func:`ikns.analysis.compare.learned_directions`.
    """
    rows = [samples.q[samples.labels == k] for k in range(len(samples.directions))]
    directions = [
        learned_directions(own, Z, variance=variance)
        for own, Z in zip(rows, samples.directions, strict=True)
    ]
    along = [own @ Z.T for own, Z in zip(rows, directions, strict=True)]
    return samples._replace(
        directions=np.stack(directions),
        lower=np.stack([c.min(axis=0) for c in along]),
        upper=np.stack([c.max(axis=0) for c in along]),
    )


def compare_map_samples(
    samples: MapSamples,
    points: NDArray[np.int64],
    *,
    variance: float,
    options: dict[str, Any],
) -> NullSpaceComparison:
    """Compare at the samples' points, whose numbers in the map are `points`."""
    found = compare_samples(**samples._asdict(), variance=variance, **options)
    return dataclasses.replace(found, points=points)


def change_coordinates(
    samples: MapSamples, name: str, columns: list[int]
) -> MapSamples:
    """Write one shoulder, of 3 columns, in other coordinates than internal angles.

    `name` is one of :data:`ikns.analysis.compare.COORDINATES`; a rotation vector starts
    from the mean posture of all samples. In the result `q` is without jumps of a full
    turn among the samples of a point; `jacobians` are by the chain rule; `directions`
    by the rates at each point's mean posture, of unit length but not orthogonal. Ranges
    are those of the internal angles.
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
