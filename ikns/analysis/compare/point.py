"""The comparison at one PCA point."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.chance import chance_inside
from ikns.analysis.compare.checks import CheckedSamples
from ikns.analysis.compare.curvature import null_turn, straight_departure
from ikns.analysis.compare.kinematics import hand_rates
from ikns.analysis.compare.leak import HandSlope, hand_slope, hand_turns
from ikns.analysis.compare.null_spaces import (
    InsideVariance,
    agreement,
    angles_to_null_spaces,
    inside_variance,
    point_null_spaces,
)
from ikns.analysis.compare.resampling import resampled_moments
from ikns.analysis.compare.subspaces import Subspaces, angle_interval, share_interval

if TYPE_CHECKING:
    from ikns.analysis.compare.kinematics import Kinematics

__all__ = ["PointFindings", "PoolParts", "compare_point"]

Array = NDArray[np.float64]


class PoolParts(NamedTuple):
    """What the values pooled over points are computed from.

    Vectors whose lengths are the findings, with their replicates (B, ...); and the
    scatter inside the null spaces and in total, as recorded and by resample.
    """

    angle: tuple[Array, Array]
    mean_posture_angle: tuple[Array, Array]
    leak: tuple[Array, Array]
    turn: tuple[Array, Array]
    inside: tuple[float, float, float]
    inside_replicates: tuple[Array, Array]
    blocks: float


class PointFindings(NamedTuple):
    """One point's entries of :class:`ikns.analysis.compare.NullSpaceComparison`."""

    counts: int
    null_directions: Array
    concentration: float
    angles: Array
    angle_interval: tuple[float, float]
    mean_posture_angles: Array
    mean_posture_interval: tuple[float, float]
    inside: float
    inside_interval: tuple[float, float]
    inside_mean_posture: float
    inside_chance: Array
    leak: Array
    leak_interval: Array
    turn: Array
    turn_interval: Array
    kinematic_leak: Array
    kinematic_turn: Array
    curvature: float
    straight_leak: float
    straight_turn: float
    agreement: float
    agreement_interval: tuple[float, float]
    parts: PoolParts


def compare_point(
    data: CheckedSamples,
    point: int,
    kinematics: Kinematics | None,
    *,
    resamples: int,
    level: float,
    variance: float,
    rng: np.random.Generator,
) -> PointFindings:
    """Compare at one point, see :func:`ikns.analysis.compare.compare_samples`."""
    rows, Z = data.rows[point], data.directions[point]
    lower, upper = data.lower[point], data.upper[point]
    q, J = data.q[rows], data.jacobians[rows]
    width = upper - lower
    c = (q @ Z.T - lower) / np.where(width > 0, width, np.nan)

    moments = resampled_moments(q, Z, resamples, rng)
    nulls = point_null_spaces(q, J, data.bases[rows], moments, kinematics)
    averaged, at_mean = angles_to_null_spaces(Z, moments, nulls, variance)
    inside = inside_variance(moments.scatter, nulls)
    leak, turn = (
        hand_slope(c, hand, resamples=resamples, level=level, rng=rng)
        for hand in (data.position[rows], hand_turns(data.rotation[rows]))
    )
    r, r_ends = agreement(Z[0], nulls.averaged[0], moments, level=level)
    mean = moments.mean[0]
    rates = hand_rates(kinematics, mean, Z, nulls.jacobian) * width[:, None, None]
    straight = straight_departure(kinematics, mean, Z, lower, upper)

    blocks, null_dim = moments.blocks, data.null_dim
    share = float(inside.averaged[0] / inside.total[0])
    shares = inside.averaged[1:] / inside.total[1:]
    return PointFindings(
        counts=len(q),
        null_directions=nulls.averaged[0],
        concentration=nulls.concentration,
        angles=averaged.angles,
        angle_interval=angle_interval(averaged, blocks, level=level, rng=rng),
        mean_posture_angles=at_mean.angles,
        mean_posture_interval=angle_interval(at_mean, blocks, level=level, rng=rng),
        inside=share,
        inside_interval=share_interval(share, shares, blocks, level=level),
        inside_mean_posture=inside.at_mean / float(inside.total[0]),
        inside_chance=chance_inside(moments.scatter[0], null_dim, seed=rng),
        leak=np.linalg.norm(leak.slope, axis=1),
        leak_interval=leak.interval,
        turn=np.linalg.norm(turn.slope, axis=1),
        turn_interval=turn.interval,
        kinematic_leak=np.linalg.norm(rates[:, 0], axis=1),
        kinematic_turn=np.linalg.norm(rates[:, 1], axis=1),
        curvature=null_turn(c[:, 0], J, null_dim),
        straight_leak=straight[0],
        straight_turn=straight[1],
        agreement=r,
        agreement_interval=r_ends,
        parts=_pool_parts(len(q), blocks, averaged, at_mean, inside, leak, turn),
    )


def _pool_parts(
    count: int,
    blocks: float,
    averaged: Subspaces,
    at_mean: Subspaces,
    inside: InsideVariance,
    leak: HandSlope,
    turn: HandSlope,
) -> PoolParts:
    total, within = count * inside.total, count * inside.averaged
    return PoolParts(
        angle=(averaged.residual, averaged.replicates),
        mean_posture_angle=(at_mean.residual, at_mean.replicates),
        leak=_flat(leak),
        turn=_flat(turn),
        inside=(float(within[0]), count * inside.at_mean, float(total[0])),
        inside_replicates=(within[1:], total[1:]),
        blocks=min(blocks, turn.blocks or leak.blocks),
    )


def _flat(found: HandSlope) -> tuple[Array, Array]:
    """Slopes of all signals as one vector, (3 d,), with replicates (B, 3 d)."""
    slope = found.slope
    return slope.ravel(), found.replicates.reshape(len(found.replicates), slope.size)
