"""Still samples near the points of a map, as arrays to compare."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.samples import NullSpaceComparison, compare_samples
from ikns.analysis.compare.subspaces import learned_directions
from ikns.errors import NotEnoughData
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap

__all__ = ["MapSamples", "compare_map_samples", "learn_again", "visited_points"]

Array = NDArray[np.float64]


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
    """Label samples by the points of a map that have enough of them.

    Parameters
    ----------
    learned : NullSpaceMap
    x : (N, 3) array
        Hand positions of the still samples, m.
    n : int
        Joints; a point needs 2 n samples.
    max_hand_speed : float
        Of the still samples, m/s, for the error.

    Returns
    -------
    labels : (N,) integer array
        Which of the P visited points, from 0; -1 for none.
    points : (P,) integer array
        Their numbers in the map, from 0.

    Raises
    ------
    NotEnoughData
        When there is no sample, or no point has enough.
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
