"""Random starts of k-means that lie far from each other."""

from __future__ import annotations

from math import log

import numpy as np

from ikns.arrays import Array
from ikns.numerics.distance import distances


def plus_plus(x: Array, n: int, rng: np.random.Generator) -> Array:
    """Draw centroids by greedy k-means++.

    Each next centroid is drawn from the samples with a probability proportional to the
    squared distance from the nearest one so far (Arthur & Vassilvitskii 2007), a few
    times, and the draw that leaves the smallest sum of these is kept. As
    ``sklearn.cluster.kmeans_plusplus``, whose import takes as long as a calibration.

    Parameters
    ----------
    x : (N, d) array
        Samples.
    n : int
        Number of centroids, at most N.
    rng : numpy.random.Generator
        Source of chance.

    Returns
    -------
    (n, d) array
        Samples; equal ones only where there are fewer than `n` different samples.
    """
    first = rng.integers(len(x))
    chosen = [x[first]]
    left = distances(x, chosen)[:, 0] ** 2
    for _ in range(1, n):
        total = left.sum()
        odds = left / total if total > 0 else None
        drawn = rng.choice(len(x), size=2 + int(log(n)), p=odds)
        lefts = np.minimum(left[:, None], distances(x, x[drawn]) ** 2)
        best = int(lefts.sum(axis=0).argmin())
        chosen.append(x[drawn[best]])
        left = lefts[:, best]
    return np.array(chosen)
