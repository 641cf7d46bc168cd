"""Learned directions compared with a null space, with bootstrap intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.numerics.bootstrap import LengthEstimate, length_estimate, student_interval
from ikns.numerics.subspace import principal_angles


class Subspaces(NamedTuple):
    """One null space against the directions.

    `angles` (k,) are principal, rad, increasing. `residual` (n,) is the part of the
    farthest direction outside the null space, whose length is the sine of the largest
    angle; `replicates` (B, n) are the same from resamples.
    """

    angles: Array
    residual: Array
    replicates: Array


def learned_directions(
    q: ArrayLike, reference: ArrayLike, *, variance: float = 0.8
) -> Array:
    """Directions that principal components of some samples give.

    As in :class:`ikns.nullspace.map.NullSpaceMap`: for one degree of freedom the
    normalized sum of the components that explain `variance`, each times its ratio and
    the sign that agrees with the reference; for d the d leading ones, turned within
    their span toward the reference.

    Parameters
    ----------
    q : (N, n) array
        Joint vectors, rad.
    reference : (d, n) array
        Directions to agree with.
    variance : float
        Part of the variance that the summed components explain.

    Returns
    -------
    (d, n) array
        Orthonormal rows.
    """
    rows = np.asarray(q, dtype=np.float64)
    around = rows - rows.mean(axis=0)
    return span_covariance(around.T @ around, np.asarray(reference), variance)


def span_covariance(S: Array, reference: Array, variance: float = 0.8) -> Array:
    """Directions from covariances (..., n, n), see :func:`learned_directions`."""
    values, vectors = np.linalg.eigh(S)
    values = np.clip(values[..., ::-1], 0.0, None)
    ratios = values / np.maximum(values.sum(axis=-1, keepdims=True), 1e-300)
    components = np.swapaxes(vectors[..., ::-1], -2, -1)
    d = len(reference)
    if d > 1:
        leading = components[..., :d, :]
        u, _, vt = np.linalg.svd(reference @ np.swapaxes(leading, -2, -1))
        return np.asarray(u @ vt @ leading)
    before = np.cumsum(ratios, axis=-1) - ratios
    weights = np.where(before < variance - 1e-12, ratios, 0.0)
    signs = np.where(components @ reference[0] < 0, -1.0, 1.0)
    total = np.einsum("...k,...kn->...n", weights * signs, components)
    return np.asarray(total / np.linalg.norm(total, axis=-1, keepdims=True))[
        ..., None, :
    ]


def compare_subspaces(
    directions: Array, null: Array, moved: Array, nulls: Array
) -> Subspaces:
    """Compare directions (d, n) with a null space (r, n), once and for every resample.

    In those the directions are `moved` (B, d, n), and the null spaces (B, r, n).
    """
    angles = principal_angles(directions, null)
    nulls = np.broadcast_to(nulls, (len(moved), *nulls.shape[-2:]))
    # The smaller space may lie in the larger one, never the other way round.
    pairs = [(directions, null), (moved, nulls)]
    if len(directions) > len(null):
        pairs = [(b, a) for a, b in pairs]
    (a, b), (A, B) = pairs
    outside = a - (a @ b.T) @ b
    farthest = np.linalg.svd(outside)[0][:, 0]
    return Subspaces(
        angles,
        farthest @ outside,
        farthest @ (A - (A @ np.swapaxes(B, -2, -1)) @ B),
    )


def angle_estimate(
    found: Subspaces, blocks: float, *, level: float, rng: np.random.Generator
) -> LengthEstimate:
    """Largest angle without what noise adds, and its interval, rad.

    Through the sine as a length.
    """
    sines = length_estimate(
        found.residual, found.replicates, blocks, level=level, rng=rng
    )
    return LengthEstimate(*(float(np.arcsin(min(sine, 1.0))) for sine in sines))


def share_interval(
    share: float, replicates: Array, blocks: float, *, level: float
) -> tuple[float, float]:
    """Confidence interval of a share, from its log odds."""
    if not 0 < share < 1:
        return np.nan, np.nan
    odds = np.log(replicates / (1 - replicates))
    found = float(np.log(share / (1 - share)))
    ends = student_interval(found, odds, blocks, level=level)
    low, high = (float(1 / (1 + np.exp(-end))) for end in ends)
    return low, high
