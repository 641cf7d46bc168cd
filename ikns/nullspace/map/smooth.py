"""Smooth fields between the points: a thin-plate spline that need not go through them.

Ends of a range that were explored scatter from place to place; an interpolant that goes
through them carries this scatter into c. It has no hull, and no edge there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices, Mask
from ikns.numerics.distance import distances

#: Smoothing, in units of the kernel between points at their mean distance: about a
#: third of a point's own value remains, the rest is its neighbors'.
_SMOOTHING = 1.0


class SmoothField:
    """Weights of a smoothing thin-plate spline between points (P, d).

    Values at the points are fitted with ``sum_i a_i |x - x_i| + affine`` and a penalty
    on the bending (Wahba 1990, Spline models for observational data). The result is
    linear in the values, so it is a row of weights, which sum to 1 and may be negative.
    With less than two points more than dimensions the mean of all points is used.

    Where a place has a larger leverage than every point, the weights fade to those of
    the mean, so that nothing is extrapolated far.

    Same methods as :class:`ikns.nullspace.interpolation.NaturalNeighborInterpolator`.
    """

    def __init__(self, points: ArrayLike, *, edges: Indices) -> None:
        self.points = np.asarray(points, dtype=np.float64)
        self.edges = edges
        p, d = self.points.shape
        self._middle = self.points.mean(axis=0)
        spread = self.points - self._middle
        self._metric = np.linalg.pinv(spread.T @ spread, hermitian=True)
        self._most = float(self._leverage(self.points).max())
        apart = distances(self.points, self.points)
        self._scale = float(apart.sum() / max(p * (p - 1), 1)) or 1.0
        self._smoother: Array | None = None
        affine = np.column_stack([np.ones(p), spread / self._scale])
        if p >= d + 2 and np.linalg.matrix_rank(affine) == d + 1:
            system = np.zeros((p + d + 1, p + d + 1))
            # The kernel -r is positive on what is orthogonal to constants.
            system[:p, :p] = -apart / self._scale + _SMOOTHING * np.eye(p)
            system[:p, p:], system[p:, :p] = affine, affine.T
            self._smoother = np.linalg.inv(system)[:, :p]

    @property
    def numbers(self) -> tuple[Array, Array, Array]:
        """What the live kernel takes of it.

        The smoother (P + d + 1, P), empty where all points weigh the same; the metric
        (d, d) of the leverage; and the middle of the points, the scale of lengths, m,
        and the largest leverage of a point, (d + 2,).
        """
        smoother = np.empty((0, 0)) if self._smoother is None else self._smoother
        return (
            np.array(smoother, order="C"),
            np.array(self._metric, order="C"),
            np.array([*self._middle, self._scale, self._most]),
        )

    def weights(self, x: ArrayLike) -> Array:
        """Weights at queries (..., d), (..., P); NaN where a query is not finite."""
        queries = np.asarray(x, dtype=np.float64)
        flat = queries.reshape(-1, queries.shape[-1])
        p = len(self.points)
        weights = np.full((len(flat), p), 1 / p)
        if self._smoother is not None:
            known = np.isfinite(flat).all(axis=1)
            at = flat[known]
            terms = np.column_stack(
                [
                    -distances(at, self.points) / self._scale,
                    np.ones(len(at)),
                    (at - self._middle) / self._scale,
                ]
            )
            beyond = np.maximum(self._leverage(at) / self._most - 1.0, 0.0)
            fade = 1 / (1 + beyond)[:, None]
            weights[known] += fade * (terms @ self._smoother - 1 / p)
        weights[~np.isfinite(flat).all(axis=1)] = np.nan
        return weights.reshape(*queries.shape[:-1], p)

    def inside(self, x: ArrayLike) -> Mask:
        """Whether queries (..., d) have at most the leverage of some point, (...).

        False everywhere with too few points for a field.
        """
        rows = np.asarray(x, dtype=np.float64)
        if self._smoother is None:
            return np.zeros(rows.shape[:-1], dtype=bool)
        return np.asarray(self._leverage(rows) <= self._most * (1 + 1e-12))

    def _leverage(self, x: Array) -> Array:
        spread = x - self._middle
        return 1 / len(self.points) + np.einsum(
            "...i,ij,...j->...", spread, self._metric, spread
        )
