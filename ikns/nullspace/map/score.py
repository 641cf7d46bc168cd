"""How much of held-out samples a map's directions explain."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.nullspace.clustering import nearest_center


def explained_share(
    x: Array, q: Array, *, centers: Array, means: Array | None, directions: Array
) -> float:
    """Share of the variance of joint vectors about their point in the span of Z.

    Parameters
    ----------
    x : (N, 3) array
        Hand positions, m; each counts to the nearest point.
    q : (N, n) array
        Joint vectors, rad.
    centers : (P, 3) array
    means : (P, n) array, optional
        Mean joint vectors of the points; without them those of these samples.
    directions : (P, d, n) array

    Returns
    -------
    float
        1 where all motion is in that span; 0 where none is, or nothing moves.
    """
    labels, _ = nearest_center(x, centers, radius=np.inf)
    rest = np.array(q, dtype=np.float64)
    for k in np.unique(labels):
        own = labels == k
        rest[own] -= rest[own].mean(axis=0) if means is None else means[k]
    # Rows of a map with known motions have unit length and are not orthogonal; rows of
    # zeros span nothing.
    _, size, basis = np.linalg.svd(directions, full_matrices=False)
    basis *= (size > 1e-9)[:, :, None]
    along = np.einsum("nk,ndk->nd", rest, basis[labels])
    total = float((rest**2).sum())
    return float((along**2).sum()) / total if total > 0 else 0.0
