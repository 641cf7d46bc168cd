"""Clusters of hand positions: k-means that starts on the data's bounding box."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ikns.arrays import Indices
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.clustering.bounding_box import (
    box_surface_points,
    minimum_bounding_box,
)
from ikns.nullspace.clustering.nearest import nearest_center


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
        if self.up is not None:
            up = np.asarray(self.up, dtype=np.float64)
            if up.shape != x.shape[1:] or not (np.isfinite(up).all() and up.any()):
                raise InvalidInput(
                    f"expected an upward direction of {x.shape[1]} numbers, found "
                    f"{up.tolist()}."
                )
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
