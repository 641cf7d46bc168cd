"""The comparison at one PCA point, and values pooled over all points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ikns.analysis.compare.chance import chance_inside
from ikns.analysis.compare.checks import CheckedSamples
from ikns.analysis.compare.kinematics import (
    Kinematics,
    hand_rates,
    null_turn,
    straight_departure,
)
from ikns.analysis.compare.leak import HandSlope, hand_slope, hand_turns
from ikns.analysis.compare.null_spaces import (
    InsideVariance,
    agreement,
    angles_to_null_spaces,
    inside_variance,
    point_null_spaces,
)
from ikns.analysis.compare.resampling import resampled_moments
from ikns.analysis.compare.subspaces import Subspaces, angle_estimate, share_interval
from ikns.arrays import Array
from ikns.numerics.bootstrap import length_estimate


def compare_point(
    data: CheckedSamples,
    point: int,
    kinematics: Kinematics | None,
    *,
    resamples: int,
    level: float,
    variance: float,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Compare at one point.

    The entries of :class:`ikns.analysis.compare.NullSpaceComparison`, and `parts` that
    :func:`pool` takes.
    """
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
    angle, mean_angle = (
        angle_estimate(each, blocks, level=level, rng=rng)
        for each in (averaged, at_mean)
    )
    share = float(inside.averaged[0] / inside.total[0])
    shares = inside.averaged[1:] / inside.total[1:]
    return dict(
        counts=len(q),
        null_directions=nulls.averaged[0],
        concentration=nulls.concentration,
        angles=averaged.angles,
        angle_corrected=angle.corrected,
        angle_interval=angle[1:],
        mean_posture_angles=at_mean.angles,
        mean_posture_interval=mean_angle[1:],
        inside=share,
        inside_interval=share_interval(share, shares, blocks, level=level),
        inside_mean_posture=inside.at_mean / float(inside.total[0]),
        inside_chance=chance_inside(moments.scatter[0], null_dim, seed=rng),
        leak=np.linalg.norm(leak.slope, axis=1),
        leak_corrected=leak.corrected,
        leak_interval=leak.interval,
        turn=np.linalg.norm(turn.slope, axis=1),
        turn_corrected=turn.corrected,
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
) -> dict[str, Any]:
    """Vectors whose lengths are the findings, with their replicates (B, ...).

    And the scatter inside the null spaces and in total, as recorded and by resample.
    """
    total, within = count * inside.total, count * inside.averaged
    return {
        "angle": (averaged.residual, averaged.replicates),
        "mean_posture_angle": (at_mean.residual, at_mean.replicates),
        "leak": _flat(leak),
        "turn": _flat(turn),
        "inside": (float(within[0]), count * inside.at_mean, float(total[0])),
        "inside_replicates": (within[1:], total[1:]),
        "blocks": min(blocks, turn.blocks or leak.blocks),
    }


def _flat(found: HandSlope) -> tuple[Array, Array]:
    """Slopes of all signals as one vector, (3 d,), with replicates (B, 3 d)."""
    slope = found.slope
    return slope.ravel(), found.replicates.reshape(len(found.replicates), slope.size)


def pool(
    points: Sequence[dict[str, Any]], *, level: float, rng: np.random.Generator
) -> dict[str, tuple[float, float, float]]:
    """Root mean squares over points (and signals), and shares of all variance.

    (value, low, high) by name, and as ``NAME_corrected`` the value without what noise
    adds, of angles, leak and turn. Points are resampled independently of each other;
    the length of all their vectors, one after the other, over the root of their number
    is the root mean square. NaN ends where there is no interval.
    """
    parts = [point["parts"] for point in points]
    blocks = float(np.mean([part["blocks"] for part in parts]))
    found: dict[str, tuple[float, float, float]] = {}
    dof = len(points[0]["leak"])
    for name in ("angle", "mean_posture_angle", "leak", "turn"):
        root = np.sqrt(len(parts) * (dof if name in ("leak", "turn") else 1))
        vector = np.concatenate([part[name][0] for part in parts]) / root
        rows = np.hstack([part[name][1] for part in parts]) / root
        estimate = length_estimate(vector, rows, blocks, level=level, rng=rng)
        values = np.array([np.linalg.norm(vector), *estimate])
        if name.endswith("angle"):
            values = np.arcsin(np.minimum(values, 1.0))
        value, corrected, low, high = values.tolist()
        found[name] = (value, low, high)
        found[f"{name}_corrected"] = (corrected, low, high)
    inside, here, total = np.sum([part["inside"] for part in parts], axis=0)
    within, whole = (
        np.sum([part["inside_replicates"][i] for part in parts], axis=0) for i in (0, 1)
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
        values = np.array([point[name] for point in points])
        found[name] = (float(np.sqrt(np.mean(values**2))), np.nan, np.nan)
    return found
