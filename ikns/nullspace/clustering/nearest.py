"""Which center a position belongs to."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Indices
from ikns.numerics.distance import distances

# An outlier is this many robust standard deviations farther from its centroid than the
# median sample. The distances of an isotropic normal distribution of
# standard deviation s have median 1.54 s and robust deviation 0.68 s, so the radius is
# 4.9 s. Hands are held less still at some points than at others: on 12 simulated
# recordings a limit of 3 lost up to 44 % of a point, 5 at most 4 %, with a radius of 14
# to 19 mm.
_OUTLIER = 5.0
_MAD_TO_DEVIATION = 1.4826  # of a normal distribution, 1 / (quantile at 3/4)
# For ten points half a meter apart 1 % is 5 mm, less than any held hand moves.
_LEAST = 0.01
_ROUNDING = 1e-12  # of the coordinates, when distances are compared


def nearest_center(
    points: ArrayLike, centers: ArrayLike, *, radius: float | None = None
) -> tuple[Indices, float]:
    """Assign every point to its nearest center, or to none when that is too far.

    Parameters
    ----------
    points : (N, d) array
        Positions, m.
    centers : (P, d) array
        Centers, m; of two equally near ones the first is chosen.
    radius : float, optional
        Points farther than this from their center belong to none. The default is taken
        from the data: the median distance plus 5 robust standard deviations (1.4826
        times the median absolute deviation) of all distances. While the user holds the
        hand at a point the distances are a few millimeters to centimeters; samples from
        the reaches between points are the outliers that this removes, as long as they
        are fewer than half of the samples. At least a hundredth of the distance across
        the centers, because outliers shift the center of a perfectly still hand by more
        than the hand moves.

    Returns
    -------
    labels : (N,) integer array
        Index of the center, or -1.
    radius : float
        The radius that was used, m.
    """
    distance = distances(points, centers)
    labels = distance.argmin(axis=1)
    nearest = distance.min(axis=1)
    if radius is None:
        median = np.median(nearest)
        deviation = _MAD_TO_DEVIATION * np.median(np.abs(nearest - median))
        # Rounding must not remove points that all have the same distance.
        rounding = _ROUNDING * np.abs(points).max()
        across = float(np.linalg.norm(np.ptp(centers, axis=0)))
        spread = median + _OUTLIER * deviation + rounding
        radius = max(float(spread), _LEAST * across)
    labels[nearest > radius] = -1
    return labels, radius
