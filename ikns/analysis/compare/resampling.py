"""Resamples of a PCA point's samples, drawn in blocks over time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.numerics.bootstrap import block_counts, block_length

__all__ = ["Moments", "Resampled", "draw", "resampled_moments"]

Array = NDArray[np.float64]


class Resampled(NamedTuple):
    """Blocks drawn from the samples of a point.

    Parameters
    ----------
    counts : (B, N) array
        How often each sample was drawn.
    blocks : float
        Blocks that fit into the samples.
    """

    counts: Array
    blocks: float


class Moments(NamedTuple):
    """Mean and scatter of joint vectors: as recorded, then in B resamples.

    Parameters
    ----------
    counts : (1 + B, N) array
        How often each sample counts; ones in the first row.
    mean : (1 + B, n) array
        rad.
    scatter : (1 + B, n, n) array
        Covariance with divisor N, rad^2.
    blocks : float
        Blocks that fit into the samples; NaN without resamples.
    """

    counts: Array
    mean: Array
    scatter: Array
    blocks: float


def resampled_moments(
    q: Array, directions: Array, resamples: int, rng: np.random.Generator
) -> Moments:
    """Mean and scatter of joint vectors (N, n), once and for every resample.

    Blocks are as long as the correlation asks for of that which turns the directions
    (d, n).
    """
    counts, blocks = np.ones((1, len(q))), np.nan
    if resamples:
        drawn = draw(_direction_scores(q, directions), resamples, rng)
        counts, blocks = np.vstack([counts, drawn.counts]), drawn.blocks
    return Moments(counts, *_covariances(q, counts), blocks)


def draw(scores: Array, resamples: int, rng: np.random.Generator) -> Resampled:
    """Draw blocks as long as these scores (N, m) ask for."""
    n, length = len(scores), block_length(scores)
    counts = block_counts(n, length, resamples, rng)
    return Resampled(counts, n / length)


def _covariances(q: Array, counts: Array) -> tuple[Array, Array]:
    """Means (B, n) and scatter matrices (B, n, n) of resampled rows (N, n)."""
    centered = q - q.mean(axis=0)
    share = counts / counts.sum(axis=1, keepdims=True)
    mean = share @ centered
    second = share @ (centered[:, :, None] * centered[:, None, :]).reshape(len(q), -1)
    n = q.shape[1]
    scatter = second.reshape(-1, n, n) - mean[:, :, None] * mean[:, None, :]
    return mean + q.mean(axis=0), scatter


def _direction_scores(q: Array, directions: Array) -> Array:
    """How much each sample turns the directions: along times across, (N, n)."""
    centered = q - q.mean(axis=0)
    along = centered @ directions.T
    return along[:, :1] * (centered - along @ directions)
