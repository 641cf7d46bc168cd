"""Everything about one PCA point."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.analysis.compare.chance import chance_inside
from ikns.analysis.compare.checks import CheckedSamples
from ikns.analysis.compare.curvature import null_turn, straight_departure
from ikns.analysis.compare.leak import hand_turns, slope_scores, slopes
from ikns.analysis.compare.subspaces import (
    angle_interval,
    compare_subspaces,
    covariances,
    direction_scores,
    draw,
    share_interval,
    span_covariance,
)
from ikns.numerics.bootstrap import length_interval, student_interval
from ikns.numerics.subspace import null_space, null_spaces

if TYPE_CHECKING:
    from ikns.analysis.compare.kinematics import Kinematics

__all__ = ["Parts", "PointFindings", "compare_point"]

Array = NDArray[np.float64]

#: Half a step along Z for the derivative of the hand's pose, rad: its error is of the
#: order of the step squared (1e-10 m/rad), that of rounding 1e-16 m over the step.
_STEP = 1e-5


class Parts(NamedTuple):
    """What the pooled values are made of.

    Vectors whose lengths are the findings, with their replicates (B, ...); and scatter
    inside the null spaces and in all, once and by resample.
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
    parts: Parts


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
    q, J, bases = data.q[rows], data.jacobians[rows], data.bases[rows]
    N, n = q.shape
    d, r = len(Z), data.null_dim
    width = data.upper[point] - data.lower[point]
    c = (q @ Z.T - data.lower[point]) / np.where(width > 0, width, np.nan)
    known = bool(np.isfinite(c).all())
    c = np.where(np.isfinite(c), c, 0.0)

    # --- null spaces, once and for every resample -----------------------------------
    once = np.ones((1, N))
    drawn = draw(direction_scores(q, Z), resamples, rng) if resamples else None
    counts = once if drawn is None else np.vstack([once, drawn.counts])
    blocks = np.nan if drawn is None else drawn.blocks
    mean, scatter = covariances(q, counts)
    projectors = np.einsum("tri,trj->tij", bases, bases).reshape(N, -1)
    values, vectors = np.linalg.eigh((counts @ projectors / N).reshape(-1, n, n))
    nulls = np.swapaxes(vectors[..., ::-1], 1, 2)[:, :r]
    if kinematics is None:
        nearest = int(np.argmin(np.sum((q - mean[0]) ** 2, axis=1)))
        middle = J[nearest]
        here = np.broadcast_to(bases[nearest], (len(counts), r, n))
    else:
        middle = kinematics.jacobian(mean[0])
        here = null_spaces(kinematics.jacobian(mean))[0][:, :r]
        here[0] = null_space(middle)[:r]
    again = span_covariance(scatter, Z, variance)
    moved = Z + again[1:] - again[:1]
    averaged = compare_subspaces(Z, nulls[0], moved, nulls[1:])
    at_mean = compare_subspaces(Z, here[0], moved, here[1:])

    # --- variance -------------------------------------------------------------------
    total = np.trace(scatter, axis1=1, axis2=2)
    within = np.einsum("bri,bij,brj->b", nulls, scatter, nulls)
    within_here = float(np.einsum("ri,ij,rj->", here[0], scatter[0], here[0]))

    # --- the hand -------------------------------------------------------------------
    place, turn = data.position[rows], hand_turns(data.rotation[rows])
    findings = []
    spread = 0.0
    for hand in (place, turn):
        slope = slopes(c, hand)
        if not known:
            slope = np.full_like(slope, np.nan)
        replicates = np.empty((0, *slope.shape))
        ends = np.full((d, 2), np.nan)
        if resamples and np.isfinite(slope).all():
            own = draw(slope_scores(c, hand), resamples, rng)
            replicates, spread = slopes(c, hand, own.counts), own.blocks
            ends = np.array(
                [
                    length_interval(
                        slope[i], replicates[:, i], own.blocks, level=level, rng=rng
                    )
                    for i in range(d)
                ]
            )
        findings.append((slope, replicates, np.linalg.norm(slope, axis=1), ends))
    (leak, leaks, leak_length, leak_ends), (turned, turns, turn_length, turn_ends) = (
        findings
    )

    # --- agreement with what the null space would read ------------------------------
    shadow = Z[0] @ nulls[0].T @ nulls[0]
    pair = np.stack([Z[0], shadow])
    both = pair @ scatter @ pair.T
    size = np.sqrt(both[:, 0, 0] * both[:, 1, 1])
    r_both = np.full(len(size), np.nan)
    np.divide(both[:, 0, 1], size, out=r_both, where=size > 0)
    r_both = np.clip(r_both, -1.0, 1.0)
    with np.errstate(divide="ignore"):
        z_both = np.arctanh(r_both)
    r_ends = np.tanh(
        student_interval(float(z_both[0]), z_both[1:], blocks, level=level)
    )

    kinematic = _kinematic(kinematics, mean[0], Z, middle) * width[:, None, None]
    straight = (np.nan, np.nan)
    if kinematics is not None:
        ends = _ends(mean[0], Z, data.lower[point], data.upper[point])
        straight = straight_departure(kinematics.pose(mean[0]), kinematics.pose(ends))
    share = float(within[0] / total[0])
    return PointFindings(
        counts=N,
        null_directions=nulls[0],
        concentration=float(values[0, -r]),
        angles=averaged.angles,
        angle_interval=angle_interval(averaged, blocks, level=level, rng=rng),
        mean_posture_angles=at_mean.angles,
        mean_posture_interval=angle_interval(at_mean, blocks, level=level, rng=rng),
        inside=share,
        inside_interval=share_interval(
            share, within[1:] / total[1:], blocks, level=level
        ),
        inside_mean_posture=within_here / float(total[0]),
        inside_chance=chance_inside(scatter[0], r, seed=rng),
        leak=leak_length,
        leak_interval=leak_ends,
        turn=turn_length,
        turn_interval=turn_ends,
        kinematic_leak=np.linalg.norm(kinematic[:, 0], axis=1),
        kinematic_turn=np.linalg.norm(kinematic[:, 1], axis=1),
        curvature=null_turn(c[:, 0], J, r),
        straight_leak=straight[0],
        straight_turn=straight[1],
        agreement=float(r_both[0]),
        agreement_interval=(float(r_ends[0]), float(r_ends[1])),
        parts=Parts(
            angle=(averaged.residual, averaged.replicates),
            mean_posture_angle=(at_mean.residual, at_mean.replicates),
            leak=(leak.ravel(), leaks.reshape(len(leaks), leak.size)),
            turn=(turned.ravel(), turns.reshape(len(turns), turned.size)),
            inside=(float(N * within[0]), N * within_here, float(N * total[0])),
            inside_replicates=(N * within[1:], N * total[1:]),
            blocks=min(blocks, spread) if resamples else np.nan,
        ),
    )


def _ends(mean: Array, Z: Array, lower: Array, upper: Array) -> Array:
    """Joint vectors where straight lines along each Z from the mean end, (2 d, n)."""
    now = Z @ mean
    steps = np.concatenate([lower - now, upper - now])
    return mean + steps[:, None] * np.concatenate([Z, Z])


def _kinematic(
    kinematics: Kinematics | None, mean: Array, Z: Array, jacobian: Array
) -> Array:
    """Hand velocity, m/rad, and turn rate, rad/rad, along each Z, (d, 2, 3)."""
    found = np.full((len(Z), 2, 3), np.nan)
    if kinematics is not None:
        x, R = kinematics.pose(mean + _STEP * np.stack([Z, -Z]))
        found[:, 0] = (x[0] - x[1]) / (2 * _STEP)
        turned = Rotation.from_matrix(R[0]) * Rotation.from_matrix(R[1]).inv()
        found[:, 1] = turned.as_rotvec() / (2 * _STEP)
    elif len(jacobian) in (3, 6):
        rates = (jacobian @ Z.T).T.reshape(len(Z), -1, 3)
        found[:, : rates.shape[1]] = rates
    return found
