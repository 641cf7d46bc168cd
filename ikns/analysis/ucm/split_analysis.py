"""Whole analyses: a split, its interval and surrogates, over trials or PCA points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.ucm.designs import across_trials, within_trial
from ikns.analysis.ucm.intervals import Interval, confidence_interval
from ikns.analysis.ucm.split import VarianceSplit
from ikns.analysis.ucm.surrogates import SurrogateTest, surrogate_test
from ikns.analysis.ucm.trials import check_repeats, movement
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData, naming
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap, still_mask
from ikns.nullspace.map.samples import samples_in


@dataclass(frozen=True, eq=False)
class SplitAnalysis:
    """A variance split with the confidence interval of its dVz, and with surrogates."""

    split: VarianceSplit
    interval: Interval
    surrogates: SurrogateTest


@dataclass(frozen=True, eq=False)
class TrialsAnalysis:
    """Movement's duration of each trial, s, and the split over normalized time.

    `overall` is the interval of the mean dVz over the movement.
    """

    durations: NDArray[np.float64]
    over_time: SplitAnalysis
    overall: Interval


@dataclass(frozen=True, eq=False)
class PointsAnalysis:
    """Still samples near each PCA point (P,), and the split by number, from 0.

    Points with too few samples are left out.
    """

    counts: NDArray[np.int64]
    points: dict[int, SplitAnalysis]


def analyze_trials(
    skeleton: Skeleton,
    motions: Sequence[Motion],
    *,
    chain: ChainLike = "right_arm",
    task: str = "position",
    threshold: float = 0.05,
    n_surrogates: int = 1000,
    seed: int = 0,
    names: Sequence[str] | None = None,
    most_different: float = 0.25,
) -> TrialsAnalysis:
    """Split the variance over repetitions of a movement, with interval and surrogates.

    Parameters
    ----------
    skeleton, motions, chain, task, threshold
        See :func:`ikns.analysis.ucm.across_trials`, also for an example; threshold in
        m/s.
    n_surrogates, seed : int
        See :func:`ikns.analysis.ucm.surrogate_test`, which shuffles trials.
    names : sequence of str, optional
        Of the trials, for errors; default "trial 1" and so on.
    most_different : float
        See :func:`ikns.analysis.ucm.trials.check_repeats`.

    Raises
    ------
    InvalidInput
        When there are not as many names as motions, or they are no repetitions of one
        movement.
    NotEnoughData
        When a motion never moves, motions are too few, or a joint is constant.
    """
    called = [f"trial {i + 1}" for i in range(len(motions))] if names is None else names
    if len(called) != len(motions):
        raise InvalidInput(
            f"expected one name a trial, found {len(called)} for {len(motions)}."
        )
    check_repeats(
        motions, called, chain, threshold=threshold, most_different=most_different
    )
    durations = []
    for motion, name in zip(motions, called, strict=True):
        with naming(name):
            cut = movement(motion.time, motion.hand_speed(chain), threshold=threshold)
        durations.append(np.ptp(motion.time[cut]))
    with naming(f"{len(motions)} trials"):
        split = across_trials(
            skeleton, motions, chain=chain, task=task, threshold=threshold
        )
    return TrialsAnalysis(
        np.array(durations),
        SplitAnalysis(
            split,
            confidence_interval(split),
            surrogate_test(split, n_surrogates=n_surrogates, seed=seed),
        ),
        confidence_interval(split, overall=True),
    )


def analyze_points(
    skeleton: Skeleton,
    motion: Motion,
    learned: NullSpaceMap,
    *,
    chain: ChainLike = "right_arm",
    task: str = "position",
    max_hand_speed: float = 0.05,
    min_still: float = 0.5,
    n_surrogates: int = 1000,
    seed: int = 0,
) -> PointsAnalysis:
    """Split the variance over the still samples at each PCA point of a map.

    Parameters
    ----------
    skeleton : Skeleton
    motion : Motion
        With the hand held at the points.
    learned : NullSpaceMap
        Of `chain`; its centers and radius say which samples are near which point.
    chain, task : str
        See :func:`ikns.analysis.ucm.within_trial`.
    max_hand_speed : float
        See :func:`ikns.nullspace.map.still_mask`, m/s.
    min_still : float
        A point with less still time is left out, s; so is one with fewer samples than
        the joints plus one.
    n_surrogates, seed : int
        See :func:`ikns.analysis.ucm.surrogate_test`, which shifts the joints' series.

    Raises
    ------
    NotEnoughData
        When no point has enough still samples, or a joint is constant at one.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion = run.points.truth
    >>> learned = ikns.NullSpaceMap(10).fit(*ikns.null_space_samples(motion))
    >>> found = analyze_points(run.subject.skeleton, motion, learned, n_surrogates=9)
    >>> all(one.split.v_ucm > one.split.v_ort for one in found.points.values())
    True
    """
    gate = still_mask(motion, chain, max_hand_speed=max_hand_speed)
    near = np.full(len(gate), -1)
    if gate.any():
        places = motion.task_position(chain)[gate]
        near[gate] = nearest_center(places, learned.centers_, radius=learned.radius_)[0]
    counts = np.bincount(near[near >= 0], minlength=len(learned.centers_))
    step = float(np.median(np.diff(motion.time)))
    least = max(len(chain_joints(chain)) + 1, samples_in(min_still, 1 / step))
    if counts.max() < least:
        raise NotEnoughData(
            f"at no PCA point was the hand held (slower than {max_hand_speed:g} m/s) "
            f"for {least} samples; the most was {counts.max()}."
        )
    points = {}
    for k in np.flatnonzero(counts >= least).tolist():
        with naming(f"PCA point {k + 1}"):
            split = within_trial(skeleton, motion, near == k, chain=chain, task=task)
        points[k] = SplitAnalysis(
            split,
            confidence_interval(split, method="bootstrap", seed=seed),
            surrogate_test(split, n_surrogates=n_surrogates, by="shift", seed=seed),
        )
    return PointsAnalysis(counts, points)
