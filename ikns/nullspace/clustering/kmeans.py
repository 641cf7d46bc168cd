"""Clusters of hand positions: k-means that starts on the data's bounding box."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.clustering.bounding_box import (
    box_surface_points,
    minimum_bounding_box,
)
from ikns.nullspace.clustering.lloyd import inertia, lloyd, two_places
from ikns.nullspace.clustering.nearest import nearest_center
from ikns.nullspace.clustering.plus_plus import plus_plus
from ikns.nullspace.estimator_base import EstimatorBase
from ikns.numerics.distance import distances

# A held place has at least this share of an equal part of the samples; fewer are on
# their way. Virtual people are steady in half of the samples of a place at the least.
_SHARE = 0.2
# Starts beside that on the box, once this one has lost a place.
_STARTS = 10


class BoundingBoxKMeans(EstimatorBase):
    """K-means that starts on the surface of the data's minimum bounding box.

    Centroids start at :func:`box_surface_points`; each sample goes to the nearest; each
    centroid moves to the mean of its samples; this repeats until no assignment changes.
    Then samples farther than `radius` from their centroid are removed.

    That start can lose a place: two places share a centroid, while another ends without
    samples or takes half a place. Only then (a cluster holds two places by
    :func:`ikns.nullspace.clustering.lloyd.two_places`, or two `groups` end in one
    cluster) others are tried: the same start with empty centroids moved to the sample
    farthest from all, the means of the groups, and ten starts by k-means++ (Arthur and
    Vassilvitskii 2007, with fixed seeds). The one that merges the fewest places is
    taken, of several the one of lowest inertia. While no place was lost a centroid
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
    start_ : {"box", "box, empty moved", "groups", "k-means++"}
        Where the centroids started.
    merged_ : list of (int, (n_features,) array, (n_features,) array)
        Clusters that hold two places all the same, and where these are, m.
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

    _fitted = "cluster_centers_"

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

    def fit(
        self, X: ArrayLike, y: Any = None, *, groups: ArrayLike | None = None
    ) -> Self:
        """Find the clusters of positions.

        Parameters
        ----------
        X : (n_samples, n_features) array
            Positions, m.
        y : object
            Ignored.
        groups : (n_samples,) integer array, optional
            Which samples are known to be of one place, by any number from 0; -1 where
            that is not known. Different numbers are different places.

        Raises
        ------
        InvalidInput
            When a parameter is out of its range, or the groups do not match.
        NotEnoughData
            When there are fewer samples than clusters.
        """
        x = self._validated(X, dtype=np.float64)
        self._check(x)
        known = _checked_groups(groups, len(x), self.n_clusters)
        self.box_ = minimum_bounding_box(x)
        on_box = box_surface_points(self.box_, self.n_clusters, up=self.up)
        found = lloyd(x, on_box, max_iter=self.max_iter)
        cut: dict[bytes, tuple[Array, Array] | None] = {}
        self.start_, self.merged_ = "box", self._merged(x, found[1], known, cut)
        if self.merged_:
            # A centroid without samples is one more place that could be kept apart.
            idle = self.n_clusters - len(np.unique(found[1]))
            rows = []
            for name, start, moved in self._starts(x, on_box, known):
                other = lloyd(x, start, max_iter=self.max_iter, move_empty=moved)
                merged = self._merged(x, other[1], known, cut)
                size = inertia(x, *other[:2])
                rows.append((len(merged), size, name, merged, other))
            # Who was told what is one place need not guess by inertia.
            best = min(rows, key=lambda row: (row[0], row[2] != "groups", row[1]))
            if best[0] < len(self.merged_) + idle:
                self.start_, self.merged_, found = best[2:]
        centers, _, self.n_iter_ = found
        self.cluster_centers_ = centers
        self.labels_, self.radius_ = nearest_center(x, centers, radius=self.radius)
        self.counts_ = np.bincount(
            self.labels_[self.labels_ >= 0], minlength=self.n_clusters
        )
        return self

    def fit_predict(
        self, X: ArrayLike, y: Any = None, *, groups: ArrayLike | None = None
    ) -> Indices:
        """Find the clusters, see :meth:`fit`, and return `labels_`, (n_samples,)."""
        return self.fit(X, groups=groups).labels_

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn that this is a clusterer, and needs no `y`."""
        from sklearn.utils import TargetTags

        tags = super().__sklearn_tags__()
        tags.estimator_type = "clusterer"
        tags.target_tags = TargetTags(required=False)
        return tags

    def _check(self, x: Array) -> None:
        """Raise what is wrong with the parameters or the number of samples."""
        if self.n_clusters < 1 or self.max_iter < 1:
            raise InvalidInput(
                f"expected at least one cluster and one iteration, found "
                f"n_clusters={self.n_clusters} and max_iter={self.max_iter}."
            )
        if self.radius is not None and not self.radius > 0:
            raise InvalidInput(f"expected a radius above 0 m, found {self.radius:g}.")
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

    def _starts(
        self, x: Array, on_box: Array, groups: Indices
    ) -> list[tuple[str, Array, bool]]:
        """Name other starts, with their centroids and whether empty ones move."""
        starts = [("box, empty moved", on_box, True)]
        means = _means(x, groups)
        if len(means) and (groups >= 0).all():
            # Clusters beyond the places wait on the box, where no hand was held.
            away = distances(on_box, means).min(axis=1)
            spare = on_box[np.argsort(-away)[: self.n_clusters - len(means)]]
            starts.append(("groups", np.vstack([means, spare]), False))
        elif len(means) == self.n_clusters:
            starts.append(("groups", means, True))
        rng = np.random.default_rng(0)
        for _ in range(_STARTS):
            drawn = plus_plus(x, self.n_clusters, rng)
            starts.append(("k-means++", drawn, True))
        return starts

    def _merged(
        self,
        x: Array,
        labels: Indices,
        groups: Indices,
        cut: dict[bytes, tuple[Array, Array] | None],
    ) -> list[tuple[int, Array, Array]]:
        """Clusters that hold two places, and where these are.

        `cut` remembers what clusters hold: most starts end with some of the same.
        """
        least = max(2, int(_SHARE * len(x) / self.n_clusters))
        across = float(np.linalg.norm(np.ptp(x, axis=0)))
        # The cluster of a group is that of most of its samples.
        home = [np.bincount(labels[groups == g]).argmax() for g in _names(groups)]
        means = _means(x, groups)
        merged = []
        for k in range(self.n_clusters):
            own = [mean for mean, h in zip(means, home, strict=True) if h == k]
            if len(own) > 1:
                merged.append((k, own[0], own[1]))
                continue
            row = labels == k
            if (name := row.tobytes()) not in cut:
                cut[name] = two_places(x[row], least=least, across=across)
            if both := cut[name]:
                merged.append((k, *both))
        return merged

    def predict(self, X: ArrayLike) -> Indices:
        """Cluster of each position, -1 beyond the radius, (n_samples,)."""
        self._check_fitted()
        x = self._validated(X, dtype=np.float64, reset=False)
        labels, _ = nearest_center(x, self.cluster_centers_, radius=self.radius_)
        return labels


def _checked_groups(groups: ArrayLike | None, n: int, n_clusters: int) -> Indices:
    """Return the group of each sample, -1 for none."""
    if groups is None:
        return np.full(n, -1)
    known = np.asarray(groups)
    if known.shape != (n,) or not np.issubdtype(known.dtype, np.integer):
        raise InvalidInput(
            f"expected the group of each of {n} samples as an integer, found an array "
            f"{known.shape} of {known.dtype}."
        )
    if (places := len(_names(known))) > n_clusters:
        raise InvalidInput(
            f"expected at most {n_clusters} groups, one for each cluster, found "
            f"{places}."
        )
    return known


def _names(groups: Indices) -> Indices:
    return np.unique(groups[groups >= 0])


def _means(x: Array, groups: Indices) -> Array:
    """Mean of each group, (G, d)."""
    rows = [x[groups == g].mean(axis=0) for g in _names(groups)]
    return np.array(rows).reshape(-1, x.shape[1])
