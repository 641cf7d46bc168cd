"""Leak: hand motion with the control signal, which should not move the hand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.analysis.compare.resampling import draw
from ikns.arrays import Array
from ikns.numerics.bootstrap import length_estimate


class HandSlope(NamedTuple):
    """How the hand moves per unit of each control signal.

    `slope` (d, 3) is in m or rad, NaN where a signal has no range; `replicates` (B, d,
    3) are the same from resamples, `corrected` (d,) the slopes' lengths without what
    noise adds, `interval` (d, 2) of these, empty and NaN without resampling; `blocks`
    how many fit into the samples, 0 without an interval.
    """

    slope: Array
    replicates: Array
    corrected: Array
    interval: Array
    blocks: float


def hand_slope(
    c: Array,
    hand: Array,
    *,
    resamples: int,
    level: float,
    rng: np.random.Generator,
) -> HandSlope:
    """Slopes of the hand (N, 3) on the control signals (N, d), with their intervals."""
    d = c.shape[1]
    if np.isnan(c).any():
        slope = np.full((d, hand.shape[1]), np.nan)
    else:
        slope = slopes(c, hand)
    if not resamples or np.isnan(slope).any():
        none = np.empty((0, *slope.shape))
        unknown = np.full((d, 3), np.nan)
        return HandSlope(slope, none, unknown[:, 0], unknown[:, 1:], 0.0)
    counts, blocks = draw(slope_scores(c, hand), resamples, rng)
    replicates = slopes(c, hand, counts)
    found = np.array(
        [
            length_estimate(slope[i], replicates[:, i], blocks, level=level, rng=rng)
            for i in range(d)
        ]
    )
    return HandSlope(slope, replicates, found[:, 0], found[:, 1:], blocks)


def slopes(c: Array, hand: Array, counts: Array | None = None) -> Array:
    """Regression slopes of the hand (N, m) on the control signals (N, d).

    Shape (d, m), or (B, d, m) with `counts` (B, N), how often each resample draws each
    sample. Each slope holds the other signals constant; NaN where they are collinear.
    """
    once = counts is None
    weight = np.ones((1, len(c))) if counts is None else counts
    d, both = c.shape[1], np.hstack([c - c.mean(axis=0), hand - hand.mean(axis=0)])
    share = weight / weight.sum(axis=1, keepdims=True)
    mean = share @ both
    products = (both[:, :d, None] * both[:, None, :]).reshape(len(c), -1)
    second = (share @ products).reshape(len(share), d, -1)
    second -= mean[:, :d, None] * mean[:, None, :]
    varies = np.linalg.eigvalsh(second[:, :, :d])[:, 0] > 1e-15
    found = np.full((len(share), d, hand.shape[1]), np.nan)
    found[varies] = np.linalg.solve(second[varies][:, :, :d], second[varies][:, :, d:])
    return found[0] if once else found


def slope_scores(c: Array, hand: Array) -> Array:
    """Influence of each sample on the slopes: c times the residual, (N, d m)."""
    deviation = c - c.mean(axis=0)
    residual = hand - hand.mean(axis=0) - deviation @ slopes(c, hand)
    return (deviation[:, :, None] * residual[:, None, :]).reshape(len(c), -1)


def hand_turns(rotation: Array) -> Array:
    """Rotation vectors from the mean of the orientations (N, 3, 3), (N, 3) rad."""
    turned = Rotation.from_matrix(rotation)
    return np.asarray((turned * turned.mean().inv()).as_rotvec())
