"""The whole comparison on plain arrays: from samples with a still hand to one table.

Everything is conditional on the given directions and ranges, as the question is how
good this map is. Only the intervals of angles include the uncertainty of learning: the
directions are learned again from every resample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.analysis.compare.chance import chance_angles
from ikns.analysis.compare.checks import checked_samples
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.point import compare_point, pool
from ikns.arrays import Array


@dataclass(frozen=True, eq=False)
class NullSpaceComparison:
    """Result of :func:`compare_samples`: one entry per PCA point, NaN where unknown.

    Intervals are (low, high) in the last axis. They allow for what noise adds to the
    length of a vector, so those of angles, leaks and turns may end below their value,
    but never below the corrected one.
    `pooled` are root mean squares over the points (and, of leaks and turns, over the d
    signals), except for the variance shares, which are those of all samples about their
    points' means.

    Parameters
    ----------
    points : (P,) integer array
        Numbers of the points in the map, from 0.
    counts : (P,) integer array
        Samples.
    null_dim : int
        Dimensions of the null space.
    directions, lower, upper : (P, d, n), (P, d), (P, d) array
        Z, m and M that were compared.
    null_directions : (P, null_dim, n) array
        Null space averaged over the visited postures.
    concentration : (P,) array
        Eigenvalue of the averaged null space's weakest direction, 0 to 1; 1 where the
        null spaces of all samples contain it.
    angles, mean_posture_angles : (P, k) array
        Principal angles to the averaged null space, and to the one at the mean posture,
        rad, increasing.
    angle_corrected : (P,) array
        Largest angle without what noise adds, rad; NaN without resamples. So are
        `leak_corrected` and `turn_corrected`, (P, d).
    angle_interval, mean_posture_interval : (P, 2) array
        Of the largest.
    chance_angles : (2,) array
        Largest angle of random directions, rad: 5th percentile and median.
    inside, inside_mean_posture : (P,) array
        Share of the joint variance inside the averaged null space, and inside that at
        the mean posture.
    inside_interval : (P, 2) array
        Of the first.
    inside_chance : (P, 2) array
        Share inside a random subspace: median and 95th percentile.
    leak, turn : (P, d) array
        Hand displacement, m, and turn, rad, per unit of c: lengths of the slopes of a
        regression over the samples, on all d signals at once.
    leak_corrected, turn_corrected : (P, d) array
    leak_interval, turn_interval : (P, d, 2) array
    kinematic_leak, kinematic_turn : (P, d) array
        Motion along Z by the Jacobian at the mean posture, per unit of c, m and rad.
    curvature : (P,) array
        Angle between the null spaces at both ends of the range of c, rad.
    straight_leak, straight_turn : (P,) array
        Deviation of the hand at the ends of straight Z, m and rad.
    agreement : (P,) array
        Correlation of c along Z with that along Z's projection on the averaged null
        space.
    agreement_interval : (P, 2) array
    pooled : dict
        Value, low and high by name: of angle, mean_posture_angle, inside,
        inside_mean_posture, leak, turn, kinematic_leak, kinematic_turn, curvature,
        straight_leak and straight_turn; NaN for ends that are not known. Also
        ``angle_corrected`` and so on, where an interval is of a length.
    """

    points: NDArray[np.int64]
    counts: NDArray[np.int64]
    null_dim: int
    directions: Array
    lower: Array
    upper: Array
    null_directions: Array
    concentration: Array
    angles: Array
    angle_corrected: Array
    angle_interval: Array
    mean_posture_angles: Array
    mean_posture_interval: Array
    chance_angles: Array
    inside: Array
    inside_interval: Array
    inside_mean_posture: Array
    inside_chance: Array
    leak: Array
    leak_corrected: Array
    leak_interval: Array
    turn: Array
    turn_corrected: Array
    turn_interval: Array
    kinematic_leak: Array
    kinematic_turn: Array
    curvature: Array
    straight_leak: Array
    straight_turn: Array
    agreement: Array
    agreement_interval: Array
    pooled: dict[str, tuple[float, float, float]]


def compare_samples(
    time: ArrayLike,
    q: ArrayLike,
    jacobians: ArrayLike,
    position: ArrayLike,
    rotation: ArrayLike,
    labels: ArrayLike,
    directions: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    kinematics: Kinematics | Sequence[Kinematics] | None = None,
    resamples: int = 400,
    level: float = 0.95,
    variance: float = 0.8,
    seed: int | np.random.Generator = 0,
) -> NullSpaceComparison:
    """Compare learned directions with the null spaces of Jacobians.

    Intervals come from a circular block bootstrap over time within each point's
    samples (:mod:`ikns.numerics.bootstrap`); those of angles, leaks and turns from
    :func:`ikns.numerics.bootstrap.length_interval`, as all are lengths of vectors that
    noise makes longer. The leak's interval reflects the short recording, not errors of
    the body model that `q` and `jacobians` share.

    Parameters
    ----------
    time : (N,) array
        Of the samples, s, increasing.
    q : (N, n) array
        Joint vectors, rad.
    jacobians : (N, k, n) array
        Of what the task holds.
    position : (N, 3) array
        Hand, m.
    rotation : (N, 3, 3) array
        Its orientation.
    labels : (N,) integer array
        PCA point of each sample, -1 for none.
    directions : (P, n) or (P, d, n) array
        Z, orthonormal rows for each point.
    lower, upper : (P,) or (P, d) array
        m and M, rad.
    kinematics : Kinematics or sequence of P Kinematics, optional
        For values at the mean posture and along straight lines. Without it the visited
        posture nearest to the mean replaces it, and values along straight lines are
        NaN.
    resamples : int
        Of the bootstrap; 0 for no intervals.
    level : float
        Confidence of intervals.
    variance : float
        See :func:`learned_directions`; what the map was fitted with.
    seed : int or numpy.random.Generator
        Source of randomness.

    Raises
    ------
    InvalidInput
        When shapes disagree, values are not finite, a Jacobian loses rank, or there is
        no null space.
    NotEnoughData
        When no sample has a label, a joint never moves, or a point has fewer samples
        than twice its joints.

    Examples
    --------
    Two joints, of which only the first moves the hand:

    >>> t = np.linspace(0, 5, 200)
    >>> q = np.stack([0.01 * np.sin(9 * t), np.sin(t)], axis=1)
    >>> hand = np.stack([q[:, 0], 0 * t, 0 * t], axis=1)
    >>> J = np.tile([[1.0, 0.0]], (200, 1, 1))
    >>> found = compare_samples(
    ...     t, q, J, hand, np.tile(np.eye(3), (200, 1, 1)), np.zeros(200, int),
    ...     [[0.0, 1.0]], [-1.0], [1.0]
    ... )
    >>> found.angles.round(6), found.inside.round(3)
    (array([[0.]]), array([1.]))
    """
    data = checked_samples(
        time, q, jacobians, position, rotation, labels, directions, lower, upper
    )
    rng = np.random.default_rng(seed)
    P, d, n = data.directions.shape
    every = (
        [kinematics] * P
        if kinematics is None or isinstance(kinematics, Kinematics)
        else list(kinematics)
    )
    points = [
        compare_point(
            data,
            k,
            own,
            resamples=resamples,
            level=level,
            variance=variance,
            rng=rng,
        )
        for k, own in enumerate(every)
    ]

    entries: dict[str, Any] = {
        name: np.array([point[name] for point in points])
        for name in points[0]
        if name != "parts"
    }
    return NullSpaceComparison(
        points=np.arange(P),
        null_dim=data.null_dim,
        directions=data.directions,
        lower=data.lower,
        upper=data.upper,
        chance_angles=chance_angles(d, data.null_dim, n, seed=rng),
        pooled=pool(points, level=level, rng=rng),
        **entries,
    )
