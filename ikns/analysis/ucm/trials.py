"""Alignment of trials: cut to the movement, time normalized."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.errors import InvalidInput, NotEnoughData, naming
from ikns.motion.excursion import other_hand_moves
from ikns.motion.motion import Motion

#: A time this part of a step from a sample is that sample's, but for rounding.
_ON = 1e-9


def movement(
    time: ArrayLike,
    speed: ArrayLike,
    *,
    threshold: float = 0.05,
    min_duration: float = 0.1,
) -> slice:
    """Find the samples from the onset to the offset of a movement.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    speed : (T,) array
        Of the hand, m/s; NaN is no movement.
    threshold : float
        The hand moves while it is faster, m/s.
    min_duration : float
        Shorter bursts are not movement, s.

    Returns
    -------
    slice
        From the first to the last sample that moves; rests in between are part of it.

    Raises
    ------
    NotEnoughData
        When nothing moves.
    """
    t, v = np.asarray(time, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    if t.ndim != 1 or t.shape != v.shape:
        raise InvalidInput(
            f"expected time and speed (T,), found {t.shape} and {v.shape}."
        )
    edges = np.flatnonzero(np.diff(np.r_[False, v > threshold, False]))
    # The last sample may miss the duration by the rounding of its time.
    bursts = [
        (first, after)
        for first, after in edges.reshape(-1, 2)
        if t[after - 1] - t[first] >= min_duration - 1e-9
    ]
    if not bursts:
        known = v[np.isfinite(v)]
        raise NotEnoughData(
            f"expected a movement faster than {threshold:g} m/s for {min_duration:g} "
            f"s, found a fastest sample of {known.max():.3g} m/s."
            if known.size
            else "expected a movement, found no sample with a known hand speed."
        )
    return slice(int(bursts[0][0]), int(bursts[-1][1]))


def normalize_time(
    values: ArrayLike,
    time: ArrayLike,
    *,
    samples: int = 101,
    kind: Literal["linear", "cubic"] = "linear",
) -> Array:
    """Resample from 0 to 100 % of a trial's time.

    Parameters
    ----------
    values : (T, ...) array
        Any quantity; NaN where unknown.
    time : (T,) array
        Seconds, increasing.
    samples : int
        How many, the first and the last sample of the trial included.
    kind : {"linear", "cubic"}
        Straight lines or a cubic spline (not-a-knot) between samples.

    Returns
    -------
    (samples, ...) array
        NaN next to a sample that is NaN: gaps are not bridged.

    Raises
    ------
    InvalidInput
        When shapes disagree or time does not increase.
    NotEnoughData
        When there are fewer than two samples.

    Examples
    --------
    >>> normalize_time([0.0, 1.0, 4.0], [2.0, 3.0, 4.0], samples=5)
    array([0. , 0.5, 1. , 2.5, 4. ])
    """
    known, t = np.asarray(values, dtype=np.float64), np.asarray(time, dtype=np.float64)
    if known.ndim < 1 or t.shape != known.shape[:1] or not (np.diff(t) > 0).all():
        raise InvalidInput(
            f"expected values (T, ...) at increasing times (T,), found {known.shape} "
            f"and {t.shape}."
        )
    if kind not in ("linear", "cubic"):
        raise InvalidInput(f"kind must be 'linear' or 'cubic', not {kind!r}.")
    if len(t) < 2 or samples < 2:
        raise NotEnoughData(
            f"expected at least 2 samples to normalize time, found {len(t)} and asked "
            f"for {samples}."
        )
    share = (t - t[0]) / (t[-1] - t[0])
    wanted = np.linspace(0.0, 1.0, samples)
    left = np.clip(np.searchsorted(share, wanted, side="right") - 1, 0, len(t) - 2)
    part = (wanted - share[left]) / (share[left + 1] - share[left])
    columns = known.reshape(len(t), -1)
    found = np.empty((samples, columns.shape[1]))
    for j, column in enumerate(columns.T):
        finite = np.isfinite(column)
        if not finite.any():
            found[:, j] = np.nan
        elif kind == "linear" or finite.sum() < 2:
            found[:, j] = np.interp(wanted, share[finite], column[finite])
        else:
            from scipy.interpolate import CubicSpline  # takes a while to load

            found[:, j] = CubicSpline(share[finite], column[finite])(wanted)
        gap = (~finite[left] & (part < 1 - _ON)) | (~finite[left + 1] & (part > _ON))
        found[gap, j] = np.nan
    return found.reshape(samples, *known.shape[1:])


def check_repeats(
    motions: Sequence[Motion],
    names: Sequence[str],
    chain: ChainLike,
    *,
    threshold: float = 0.05,
    most_different: float = 0.25,
) -> None:
    """Check that motions repeat one movement of a chain's hand.

    Parameters
    ----------
    motions : sequence of Motion
        One a trial.
    names : sequence of str
        Of the trials.
    chain : str
        Whose hand moves.
    threshold : float
        See :func:`movement`, m/s.
    most_different : float
        Largest root mean square distance of two hand paths over normalized time, each
        about its own middle, over the excursion of the longer. Seven people's repeats
        of four daily tasks are within 0.24, but for one trial; their different tasks
        0.20 to 0.49 apart, 19 of 20 above 0.26 (the most alike: to drink, to comb).

    Raises
    ------
    InvalidInput
        When in a trial the other hand moves farther, or two trials are too different.
    NotEnoughData
        When nothing moves.
    """
    if not 0 <= most_different < np.inf:
        raise InvalidInput(
            f"expected most_different of at least 0, found {most_different:g}."
        )
    paths = []
    for motion, name in zip(motions, names, strict=True):
        if other := other_hand_moves([motion], chain):
            raise InvalidInput(
                f"{name}: expected a movement of {chain}, found that {other}."
            )
        with naming(name):
            cut = movement(motion.time, motion.hand_speed(chain), threshold=threshold)
        place = motion.task_position(chain)[cut]
        seen = np.isfinite(place).all(axis=1)
        path = normalize_time(place[seen], motion.time[cut][seen])
        paths.append(path - path.mean(axis=0))
    excursions = [float(np.linalg.norm(np.ptp(path, axis=0))) for path in paths]
    worst = (most_different, 0, 0)
    for i, j in combinations(range(len(paths)), 2):
        apart = np.sqrt(np.mean(np.sum((paths[i] - paths[j]) ** 2, axis=1)))
        worst = max(worst, (float(apart) / max(excursions[i], excursions[j]), i, j))
    share, i, j = worst
    if i != j:
        raise InvalidInput(
            f"expected repetitions of one movement, found hand paths of {names[i]} and "
            f"{names[j]} that differ by {100 * share:.0f} % of their size (at most "
            f"{100 * most_different:g} %)."
        )


def aligned_angles(
    motions: Sequence[Motion],
    chain: ChainLike,
    *,
    samples: int = 101,
    threshold: float = 0.05,
) -> Array:
    """Joint angles of the body over the normalized time of each motion's movement.

    Parameters
    ----------
    motions : sequence of Motion
        One a trial.
    chain : str
        Whose hand moves.
    samples : int
        See :func:`normalize_time`.
    threshold : float
        See :func:`movement`, m/s.

    Returns
    -------
    (trials, samples, 18) array
        Radians; NaN while the chain is not in sight.
    """
    trials = []
    for motion in motions:
        cut = movement(motion.time, motion.hand_speed(chain), threshold=threshold)
        angles = np.array(motion.angles[cut])
        angles[np.isnan(motion.task_position(chain)[cut, 0])] = np.nan
        time = motion.time[cut]
        trials.append(normalize_time(angles, time, samples=samples))
    if not trials:
        raise NotEnoughData("expected at least one motion, found none.")
    return np.stack(trials)
