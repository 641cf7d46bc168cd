"""Clusters of hand positions: k-means that starts on the data's bounding box."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ikns.arrays import Indices
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.clustering.bounding_box import (
    box_surface_points,
    minimum_bounding_box,
)

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
    distance = cdist(points, centers)
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


class BoundingBoxKMeans(ClusterMixin, BaseEstimator):
    """K-means that starts on the surface of the data's minimum bounding box.

    Centroids start at :func:`box_surface_points`; each sample goes to the nearest; each
    centroid moves to the mean of its samples; this repeats until no assignment changes.
    Then samples farther than `radius` from their centroid are removed. A centroid
    without samples stays where it is.

    Parameters
    ----------
    n_clusters : int
        How many centroids.
    max_iter : int
        Most iterations.
    radius : float, optional
        Farthest a sample may be from its centroid, m; the default is the rule of
        :func:`nearest_center`.
    up : (n_features,) array, optional
        Upward direction, see :func:`box_surface_points`.

    Attributes
    ----------
    cluster_centers_ : (n_clusters, n_features) array
        Means of the samples assigned, those beyond the radius included, m.
    labels_ : (n_samples,) integer array
        Cluster of each sample; -1 beyond the radius.
    counts_ : (n_clusters,) integer array
        Samples within the radius.
    n_iter_ : int
        Iterations taken.
    radius_ : float
        The radius used, m.
    box_ : BoundingBox
        The minimum bounding box of the samples.
    n_features_in_ : int
        Dimensions of the samples.

    Examples
    --------
    >>> x = [[0.0, 0.0, 0.1], [0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 4.0, 0.1]]
    >>> BoundingBoxKMeans(n_clusters=2).fit(x).cluster_centers_[:, 1].tolist()
    [4.0, 0.0]
    """

    def __init__(
        self,
        n_clusters: int = 10,
        *,
        max_iter: int = 300,
        radius: float | None = None,
        up: ArrayLike | None = None,
    ) -> None:
        self.n_clusters = n_clusters
        self.max_iter = max_iter
        self.radius = radius
        self.up = up

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Find the clusters of positions (n_samples, n_features), m; `y` is ignored.

        Raises
        ------
        InvalidInput
            When a parameter is out of its range.
        NotEnoughData
            When there are fewer samples than clusters.
        """
        x = validate_data(self, X, dtype=np.float64)
        if self.n_clusters < 1 or self.max_iter < 1:
            raise InvalidInput(
                f"expected at least one cluster and one iteration, found "
                f"n_clusters={self.n_clusters} and max_iter={self.max_iter}."
            )
        if self.radius is not None and not self.radius > 0:
            raise InvalidInput(f"expected a radius above 0 m, found {self.radius}.")
        if len(x) < self.n_clusters:
            raise NotEnoughData(
                f"found n_samples={len(x)}, expected at least one for each of the "
                f"{self.n_clusters} clusters."
            )
        self.box_ = minimum_bounding_box(x)
        centers = box_surface_points(self.box_, self.n_clusters, up=self.up)
        labels = np.full(len(x), -1)
        for n_iter in range(1, self.max_iter + 1):
            self.n_iter_ = n_iter
            previous, (labels, _) = labels, nearest_center(x, centers, radius=np.inf)
            if (labels == previous).all():
                break
            for k in np.unique(labels):
                centers[k] = x[labels == k].mean(axis=0)
        self.cluster_centers_ = centers
        self.labels_, self.radius_ = nearest_center(x, centers, radius=self.radius)
        self.counts_ = np.bincount(
            self.labels_[self.labels_ >= 0], minlength=self.n_clusters
        )
        return self

    def predict(self, X: ArrayLike) -> Indices:
        """Cluster of each position, -1 beyond the radius, (n_samples,)."""
        check_is_fitted(self)
        x = validate_data(self, X, dtype=np.float64, reset=False)
        labels, _ = nearest_center(x, self.cluster_centers_, radius=self.radius_)
        return labels
