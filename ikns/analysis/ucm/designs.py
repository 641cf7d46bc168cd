"""Both designs on motions of a skeleton: over repetitions, and within one recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.analysis.ucm.split import VarianceSplit, variance_split
from ikns.analysis.ucm.tasks import chain_task
from ikns.analysis.ucm.trials import aligned_angles
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.motion import Motion


def across_trials(
    skeleton: Skeleton,
    motions: Sequence[Motion],
    *,
    chain: ChainLike = "right_arm",
    task: str = "position",
    samples: int = 101,
    threshold: float = 0.05,
    min_trials: int | None = None,
) -> VarianceSplit:
    """Split the variance over repetitions of a movement, at each normalized time.

    Parameters
    ----------
    skeleton : Skeleton
    motions : sequence of Motion
        Repetitions of one movement; each is cut to it by the hand's speed.
    chain : str
        Joints of the split, see :class:`ikns.Chain`. The others take their
        mean over the trials.
    task : {"position", "pose"}
        Of the hand in the thorax frame.
    samples, threshold
        See :func:`ikns.analysis.ucm.aligned_angles`; threshold in m/s.
    min_trials : int, optional
        See :func:`ikns.analysis.ucm.variance_split`.

    Returns
    -------
    VarianceSplit
        Fields (samples,).

    Raises
    ------
    NotEnoughData
        When a motion never moves, motions are too few, or a joint is constant.

    Examples
    --------
    Eight times the same reach, each joint off by a constant:

    >>> import ikns
    >>> from dataclasses import replace
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion, rng = run.points.truth, np.random.default_rng(0)
    >>> offsets = np.hstack([np.zeros((8, 7)), 0.02 * rng.normal(size=(8, 18))])
    >>> trials = [replace(motion, q=motion.q + offset) for offset in offsets]
    >>> across_trials(run.subject.skeleton, trials).v_ucm.shape
    (101,)
    """
    least = len(chain_joints(chain)) + 1 if min_trials is None else min_trials
    if len(motions) < least:
        raise NotEnoughData(
            f"expected at least {least} trials for the {len(chain_joints(chain))} "
            f"joints of {chain}, found {len(motions)}."
        )
    angles = aligned_angles(motions, chain, samples=samples, threshold=threshold)
    return _split(skeleton, angles, chain, task, min_trials)


def within_trial(
    skeleton: Skeleton,
    motion: Motion,
    where: ArrayLike,
    *,
    chain: ChainLike = "right_arm",
    task: str = "position",
    min_samples: int | None = None,
) -> VarianceSplit:
    """Split the variance over samples of one recording, such as those of a held hand.

    The samples should belong to one posture of the task: over a whole reach the
    movement itself is most of V_ORT.

    Parameters
    ----------
    skeleton : Skeleton
    motion : Motion
    where : (T,) boolean array
        Which samples, as from :func:`ikns.nullspace.map.still_mask`.
    chain, task
        See :func:`across_trials`.
    min_samples : int, optional
        See `min_trials` of :func:`ikns.analysis.ucm.variance_split`.

    Returns
    -------
    VarianceSplit
        A single one.

    Raises
    ------
    InvalidInput
        When `where` does not fit the motion.
    NotEnoughData
        When samples are too few or a joint is constant.

    Examples
    --------
    The elbow swivels while the hand's pose is held at the first point:

    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion, first = run.points.truth, run.points.point == 0
    >>> split = within_trial(run.subject.skeleton, motion, first, task="pose")
    >>> bool(split.v_ucm > 10 * split.v_ort)
    True
    """
    chosen = np.asarray(where, dtype=bool)
    if chosen.shape != motion.time.shape:
        raise InvalidInput(
            f"expected which of {len(motion.time)} samples, found {chosen.shape}."
        )
    return _split(skeleton, motion.angles[chosen], chain, task, min_samples)


def _split(
    skeleton: Skeleton,
    angles: NDArray[np.float64],
    chain: ChainLike,
    task: str,
    least: int | None,
) -> VarianceSplit:
    joints = chain_joints(chain)
    known = np.isfinite(angles)
    with np.errstate(invalid="ignore"):
        total = np.where(known, angles, 0.0).sum(axis=0)
        mean = total / np.count_nonzero(known, axis=0)
    return variance_split(
        angles[..., [skeleton.joint_names.index(name) for name in joints]],
        chain_task(skeleton, chain, mean, task=task),
        min_trials=least,
        joint_names=joints,
    )
