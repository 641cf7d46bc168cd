"""Leak: how the hand moves with the control signal, which should leave it alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["hand_turns", "slope_scores", "slopes"]

Array = NDArray[np.float64]


def slopes(c: Array, hand: Array, counts: Array | None = None) -> Array:
    """Regression slopes of the hand on the control signals.

    Parameters
    ----------
    c : (N, d) array
        Control signals.
    hand : (N, m) array
        Hand positions, m, or turns, rad.
    counts : (B, N) array, optional
        How often each sample counts in each resample.

    Returns
    -------
    (d, m) or (B, d, m) array
        Of each signal while the others stay; NaN where they do not vary by themselves.
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
    """How much each sample moves the slopes: c times the residual, (N, d m)."""
    deviation = c - c.mean(axis=0)
    residual = hand - hand.mean(axis=0) - deviation @ slopes(c, hand)
    return (deviation[:, :, None] * residual[:, None, :]).reshape(len(c), -1)


def hand_turns(rotation: Array) -> Array:
    """Turn of each orientation (N, 3, 3) from their mean, (N, 3) rad."""
    turned = Rotation.from_matrix(rotation)
    return np.asarray((turned * turned.mean().inv()).as_rotvec())
