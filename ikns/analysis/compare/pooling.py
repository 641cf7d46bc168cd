"""Values pooled over all points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.point import PointFindings
from ikns.analysis.compare.subspaces import share_interval
from ikns.numerics.bootstrap import length_interval

__all__ = ["pool"]

Array = NDArray[np.float64]


def pool(
    points: Sequence[PointFindings], *, level: float, rng: np.random.Generator
) -> dict[str, tuple[float, float, float]]:
    """Root mean squares over points (and signals), and shares of all variance.

    Parameters
    ----------
    points : sequence of PointFindings
    level : float
        Confidence.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    dict of (value, low, high)
        Points are resampled independently of each other; the length of all their
        vectors, one after the other, over the root of their number is the root mean
        square. NaN ends where there is no interval.
    """
    parts = [point.parts for point in points]
    blocks = float(np.mean([part.blocks for part in parts]))
    found: dict[str, tuple[float, float, float]] = {}
    dof = len(points[0].leak)
    for name in ("angle", "mean_posture_angle", "leak", "turn"):
        root = np.sqrt(len(parts) * (dof if name in ("leak", "turn") else 1))
        vector = np.concatenate([getattr(part, name)[0] for part in parts]) / root
        rows = np.hstack([getattr(part, name)[1] for part in parts]) / root
        ends = length_interval(vector, rows, blocks, level=level, rng=rng)
        values = np.array([np.linalg.norm(vector), *ends])
        if name.endswith("angle"):
            values = np.arcsin(np.minimum(values, 1.0))
        found[name] = (float(values[0]), float(values[1]), float(values[2]))
    inside, here, total = np.sum([part.inside for part in parts], axis=0)
    within, whole = (
        np.sum([part.inside_replicates[i] for part in parts], axis=0) for i in (0, 1)
    )
    share = float(inside / total)
    low, high = share_interval(share, within / whole, blocks, level=level)
    found["inside"] = (share, low, high)
    found["inside_mean_posture"] = (float(here / total), np.nan, np.nan)
    for name in (
        "kinematic_leak",
        "kinematic_turn",
        "curvature",
        "straight_leak",
        "straight_turn",
    ):
        values = np.array([getattr(point, name) for point in points])
        found[name] = (float(np.sqrt(np.mean(values**2))), np.nan, np.nan)
    return found
