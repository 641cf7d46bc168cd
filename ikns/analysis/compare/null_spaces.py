"""The null spaces of a PCA point: averaged over its samples, and at its mean posture.

What is measured against them: angles, the joint variance inside, and the control signal
that the null space itself would give.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.resampling import Moments
from ikns.analysis.compare.subspaces import (
    Subspaces,
    compare_subspaces,
    span_covariance,
)
from ikns.arrays import Array
from ikns.numerics.bootstrap import student_interval
from ikns.numerics.subspace import null_space, null_spaces


class NullSpaces(NamedTuple):
    """Null spaces of a point: as recorded, then in B resamples.

    Orthonormal rows (1 + B, r, n), averaged over the samples' postures and at the mean
    posture; `concentration` is the eigenvalue of the weakest averaged direction, 0 to
    1, `jacobian` that at the mean posture.
    """

    averaged: Array
    at_mean: Array
    concentration: float
    jacobian: Array


class InsideVariance(NamedTuple):
    """Joint variance, rad^2, in total and inside null spaces.

    `total` and `averaged` (1 + B,) as recorded, then in B resamples.
    """

    total: Array
    averaged: Array
    at_mean: float


def point_null_spaces(
    q: Array,
    jacobians: Array,
    bases: Array,
    moments: Moments,
    kinematics: Kinematics | None,
) -> NullSpaces:
    """Null spaces of samples (N, n) with Jacobians (N, k, n) and bases (N, r, n).

    Without kinematics the posture nearest to the mean replaces it.
    """
    (N, n), r = q.shape, bases.shape[1]
    projectors = np.einsum("tri,trj->tij", bases, bases).reshape(N, -1)
    values, vectors = np.linalg.eigh(
        (moments.counts @ projectors / N).reshape(-1, n, n)
    )
    averaged = np.swapaxes(vectors[..., ::-1], 1, 2)[:, :r]
    if kinematics is None:
        nearest = int(np.argmin(np.sum((q - moments.mean[0]) ** 2, axis=1)))
        jacobian = jacobians[nearest]
        at_mean = np.broadcast_to(bases[nearest], averaged.shape)
    else:
        jacobian = kinematics.jacobian(moments.mean[0])
        at_mean = null_spaces(kinematics.jacobian(moments.mean))[0][:, :r]
        at_mean[0] = null_space(jacobian)[:r]
    return NullSpaces(averaged, at_mean, float(values[0, -r]), jacobian)


def angles_to_null_spaces(
    Z: Array, moments: Moments, nulls: NullSpaces, variance: float
) -> tuple[Subspaces, Subspaces]:
    """Directions (d, n) against the averaged null space and that at the mean posture.

    In each resample the directions turn as much as those learned from it do.
    """
    again = span_covariance(moments.scatter, Z, variance)
    moved = Z + again[1:] - again[:1]
    averaged, at_mean = (
        compare_subspaces(Z, null[0], moved, null[1:])
        for null in (nulls.averaged, nulls.at_mean)
    )
    return averaged, at_mean


def inside_variance(scatter: Array, nulls: NullSpaces) -> InsideVariance:
    """Joint variance of scatter matrices (1 + B, n, n) inside the null spaces."""
    own, here = nulls.averaged, nulls.at_mean[0]
    return InsideVariance(
        total=np.trace(scatter, axis1=1, axis2=2),
        averaged=np.einsum("bri,bij,brj->b", own, scatter, own),
        at_mean=float(np.einsum("ri,ij,rj->", here, scatter[0], here)),
    )


def agreement(
    z: Array, null: Array, moments: Moments, *, level: float
) -> tuple[float, tuple[float, float]]:
    """Correlation of c along a direction and along its projection on a null space.

    Its interval is Student's on Fisher's transform.
    """
    pair = np.stack([z, z @ null.T @ null])
    covariance = pair @ moments.scatter @ pair.T
    size = np.sqrt(covariance[:, 0, 0] * covariance[:, 1, 1])
    r = np.full(len(size), np.nan)
    np.divide(covariance[:, 0, 1], size, out=r, where=size > 0)
    r = np.clip(r, -1.0, 1.0)
    with np.errstate(divide="ignore"):
        transformed = np.arctanh(r)
    low, high = np.tanh(
        student_interval(
            float(transformed[0]), transformed[1:], moments.blocks, level=level
        )
    )
    return float(r[0]), (float(low), float(high))
