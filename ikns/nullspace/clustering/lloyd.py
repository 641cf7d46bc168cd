"""Lloyd's iteration, and whether a cluster holds two places."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices
from ikns.numerics.distance import distances

#: Two halves of one held place are at most 3.5 deviations apart along their line (a
#: uniform segment, cut in the middle: L / 2 over L / sqrt(48); less for a normal one).
_SEPARATE = 4.5
#: Nor are places those that differ by less than this share of the distance across all
#: samples: 2.5 cm of half a meter, as far as a held hand drifts.
_APART = 0.05
_MAD_TO_DEVIATION = 1.4826  # of a normal distribution, 1 / (quantile at 3/4)
#: Cuts that are tried within a cluster: some of them only remove stragglers.
_DEPTH = 4


def lloyd(
    x: Array, centers: Array, *, max_iter: int, move_empty: bool = False
) -> tuple[Array, Indices, int]:
    """Iterate assignments and means until no assignment changes (Lloyd 1982).

    Parameters
    ----------
    x : (N, d) array
        Samples.
    centers : (P, d) array
        Where the centroids start.
    max_iter : int
        Most iterations.
    move_empty : bool
        Whether a centroid that ends without samples moves to the sample that is
        farthest from every centroid, to go on from there. Otherwise it stays.

    Returns
    -------
    centers : (P, d) array
    labels : (N,) integer array
    n_iter : int
    """
    centers = np.array(centers)
    labels = np.full(len(x), -1)
    n_iter = 0
    while n_iter < max_iter:
        n_iter += 1
        distance = distances(x, centers)
        previous, labels = labels, distance.argmin(axis=1)
        counts = np.bincount(labels, minlength=len(centers))
        if (labels == previous).all():
            farthest = distance.min(axis=1) if move_empty else np.zeros(1)
            if counts.all() or not farthest.max() > 0:
                break
            centers[counts.argmin()] = x[farthest.argmax()]
            continue
        for k in np.flatnonzero(counts):
            centers[k] = x[labels == k].mean(axis=0)
    return centers, labels, n_iter


def inertia(x: Array, centers: Array, labels: Indices) -> float:
    """Sum of squared distances of samples from their own center."""
    return float(((x - centers[labels]) ** 2).sum())


def two_places(
    x: Array, *, least: int, across: float, depth: int = _DEPTH
) -> tuple[Array, Array] | None:
    """Two places (d,) that the samples of one cluster (N, d) hold; None where one.

    The samples are cut in two, the smaller part is set aside while it has fewer than
    `least` samples, and the parts are two places when their medians are 4.5 robust
    deviations apart along the line between them, and a twentieth of `across`.
    """
    if len(x) < 2 * least or depth == 0:
        return None
    axis = np.linalg.svd(x - x.mean(axis=0), full_matrices=False)[2][0]
    ends = x[np.argsort(x @ axis)[[0, -1]]]
    labels = lloyd(x, ends, max_iter=50)[1]
    parts = sorted((x[labels == 0], x[labels == 1]), key=len)
    if len(parts[0]) < least:
        if not len(parts[0]):
            return None
        return two_places(parts[1], least=least, across=across, depth=depth - 1)
    middles = [np.median(part, axis=0) for part in parts]
    gap = float(np.linalg.norm(middles[1] - middles[0]))
    if gap > 0:
        line = (middles[1] - middles[0]) / gap
        spread = [
            float(np.median(np.abs((part - middle) @ line)))
            for part, middle in zip(parts, middles, strict=True)
        ]
        deviation = _MAD_TO_DEVIATION * float(np.mean(spread))
        if gap > _SEPARATE * deviation and gap > _APART * across:
            return middles[0], middles[1]
    for part in parts:
        if found := two_places(part, least=least, across=across, depth=depth - 1):
            return found
    return None
