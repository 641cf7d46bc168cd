"""Resamples of a PCA point's samples, drawn in blocks over time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.numerics.bootstrap import block_counts, blocks_for


class Moments(NamedTuple):
    """Mean and scatter of joint vectors: as recorded, then in B resamples.

    `counts` (1 + B, N) is how often each sample counts, ones in the first row;
    `scatter` the covariance with divisor N, rad^2; `blocks` how many the samples are
    worth, NaN without resamples.
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
        drawn, blocks = draw(_direction_scores(q, directions), resamples, rng)
        counts = np.vstack([counts, drawn])
    return Moments(counts, *_covariances(q, counts), blocks)


def draw(
    scores: Array, resamples: int, rng: np.random.Generator
) -> tuple[Array, float]:
    """Draw blocks as long as these scores (N, m) ask for.

    How often each sample was drawn, (B, N), and how many blocks the samples are worth.
    """
    length, count = blocks_for(scores)
    return block_counts(len(scores), length, resamples, rng), count


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
