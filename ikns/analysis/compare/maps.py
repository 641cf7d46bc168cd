"""A learned map compared with an analytic one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.leak import hand_turns, slope_scores, slopes
from ikns.analysis.compare.resampling import draw
from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.errors import InvalidInput
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap, null_space_samples, still_mask
from ikns.numerics.bootstrap import LengthEstimate, length_estimate
from ikns.numerics.subspace import principal_angles

#: Fewer samples have no interval.
_LEAST = 10


@dataclass(frozen=True, eq=False)
class MapComparison:
    """Result of :func:`compare`, one entry per PCA point.

    Parameters
    ----------
    centers : (P, 3) array
        PCA points in the thorax frame, m.
    counts : (P,) integer array
        Still samples of the motion near each point.
    angles : (P, d) array
        Principal angles between learned and analytic directions, rad, smallest first.
    inside : (P,) array
        Share of the samples' joint variance that lies along the analytic directions.
    learned_leak, analytic_leak : (P,) array
        Hand displacement while c goes from 0 to 1 there, m: the slope of hand position
        on c over the samples. It should be zero.
    learned_turn, analytic_turn : (P,) array
        Hand rotation meanwhile, rad: likewise.
    learned_leak_corrected : (P,) array
        The first without what noise adds, m; NaN where there is no interval.
    learned_leak_interval : (P, 2) array
        95 % confidence interval of the learned leak (block bootstrap over time, see
        :mod:`ikns.numerics.bootstrap`); NaN with fewer than ten samples.
    agreement : (P,) array
        Correlation of the two control signals over the samples (first degree of
        freedom); NaN with fewer than three samples or no motion.
    """

    centers: Array
    counts: NDArray[np.int64]
    angles: Array
    inside: Array
    learned_leak: Array
    analytic_leak: Array
    learned_turn: Array
    analytic_turn: Array
    learned_leak_corrected: Array
    learned_leak_interval: Array
    agreement: Array


def compare(
    learned: NullSpaceMap,
    analytic: NullSpaceMap,
    motion: Motion,
    *,
    chain: ChainLike = "right_arm",
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
    resamples: int = 400,
    seed: int | np.random.Generator = 0,
) -> MapComparison:
    """Compare two maps with the same PCA points on a motion.

    :func:`ikns.analysis.compare.compare_motion` does more: with a skeleton it also
    compares null spaces at the mean posture, their curvature, and the chance level.

    Parameters
    ----------
    learned, analytic : NullSpaceMap
        As from :meth:`NullSpaceMap.fit` and :func:`ikns.nullspace.map.analytic_map` at
        ``learned.centers_``.
    motion : Motion
        Any motion with still hands near the points.
    chain : str
        See :class:`ikns.Chain`.
    max_hand_speed, min_duration : float
        Gate on the hand, see :func:`ikns.nullspace.map.still_mask`, m/s and s.
    resamples : int
        For the interval of the leak; 0 for none.
    seed : int or numpy.random.Generator
        Source of their randomness.

    Raises
    ------
    InvalidInput
        When the maps have different points or degrees of freedom.
    NotEnoughData
        When no sample passes the gate.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion, body = run.points.truth, run.subject.skeleton
    >>> learned = NullSpaceMap(10).fit(*null_space_samples(motion))
    >>> analytic = ikns.analytic_map(body, motion, learned.centers_)
    >>> bool(np.degrees(compare(learned, analytic, motion).angles).max() < 15)
    True
    """
    if learned.directions_.shape != analytic.directions_.shape or not np.allclose(
        learned.centers_, analytic.centers_
    ):
        raise InvalidInput(
            "both maps must have the same PCA points, joints and degrees of freedom; "
            f"found directions {learned.directions_.shape} and "
            f"{analytic.directions_.shape}."
        )
    limits = {"max_hand_speed": max_hand_speed, "min_duration": min_duration}
    x, q = null_space_samples(motion, chain, **limits)
    gate = still_mask(motion, chain, **limits)
    rotation = motion.task_rotation(chain)[gate]
    radius = getattr(learned, "radius_", None)
    labels, _ = nearest_center(x, learned.centers_, radius=radius)
    rng = np.random.default_rng(seed)
    n = len(learned.centers_)
    inside, agreement, ends = np.full(n, np.nan), np.full(n, np.nan), []
    leaks, turns = np.full((2, n), np.nan), np.full((2, n), np.nan)
    for i in range(n):
        own = labels == i
        # The points' own directions, not interpolated: each is judged at its point.
        signals = [_local_signal(m, i, q[own]) for m in (learned, analytic)]
        if own.sum() > 2:
            turn = hand_turns(rotation[own])
            leaks[:, i] = [_slope_norm(x[own], c) for c in signals]
            turns[:, i] = [_slope_norm(turn, c) for c in signals]
        ends.append(_leak_estimate(x[own], signals[0], resamples, rng))
        centered = q[own] - q[own].mean(axis=0) if own.any() else q[own]
        total = float(np.sum(centered**2))
        if total > 0:
            along = centered @ analytic.directions_[i].T
            inside[i] = float(np.sum(along**2)) / total
        if own.sum() > 2 and all(np.ptp(c) > 0 for c in signals):
            agreement[i] = float(np.corrcoef(signals[0], signals[1])[0, 1])
    return MapComparison(
        centers=learned.centers_,
        counts=np.bincount(labels[labels >= 0], minlength=n),
        angles=principal_angles(learned.directions_, analytic.directions_),
        inside=inside,
        learned_leak=leaks[0],
        analytic_leak=leaks[1],
        learned_turn=turns[0],
        analytic_turn=turns[1],
        learned_leak_corrected=np.array([each.corrected for each in ends]),
        learned_leak_interval=np.array([each[1:] for each in ends]),
        agreement=agreement,
    )


def _local_signal(mapped: NullSpaceMap, point: int, q: Array) -> Array:
    """First control signal of one point's own direction, (N,)."""
    lower, upper = mapped.lower_[point, 0], mapped.upper_[point, 0]
    width = upper - lower if upper > lower else np.nan
    return np.asarray((q @ mapped.directions_[point, 0] - lower) / width)


def _slope_norm(hand: Array, c: Array) -> float:
    """Length of the slope of hand (N, 3) on c (N,); NaN without variation of c."""
    if not np.isfinite(c).all():
        return float("nan")
    return float(np.linalg.norm(slopes(c[:, None], hand)))


def _leak_estimate(
    x: Array, c: Array, resamples: int, rng: np.random.Generator
) -> LengthEstimate:
    """Length of the slope of x (N, 3) on c (N,), with its interval."""
    if len(c) < _LEAST or not resamples or not np.isfinite(_slope_norm(x, c)):
        return LengthEstimate(np.nan, np.nan, np.nan)
    signal = c[:, None]
    counts, blocks = draw(slope_scores(signal, x), resamples, rng)
    replicates = slopes(signal, x, counts)[:, 0]
    return length_estimate(slopes(signal, x)[0], replicates, blocks, rng=rng)
