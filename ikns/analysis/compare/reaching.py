"""Crosstalk: changes of the control signal during reaches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.reaches import find_reaches
from ikns.numerics.bootstrap import block_counts, blocks_for, student_interval

#: Neighboring reaches share the rest between them, so their changes are correlated, by
#: 0.22 for normally distributed c at unrelated rests. Then G / g(0) of
#: :func:`ikns.numerics.bootstrap.blocks_for` is 0.3, and three reaches lose a tenth
#: of the variance; a dozen reaches are too few to estimate that.
_LEAST_BLOCK = 3


@dataclass(frozen=True, eq=False)
class Crosstalk:
    """Result of :func:`crosstalk`; one entry per reach.

    Parameters
    ----------
    reaches : (R, 2) integer array
        Last sample of the rest before and first of the rest after.
    change : (R,) array
        c after the reach less c before it.
    distance : (R,) array
        From rest to rest, m.
    excursion : (R,) array
        Largest deviation of c from its value before the reach.
    mean_change, per_meter, largest : float
        Mean of ``abs(change)``; its sum over the sum of distances, 1/m; the largest
        excursion.
    mean_change_interval, per_meter_interval : (float, float)
        NaN with fewer than 6 reaches.
    """

    reaches: NDArray[np.int64]
    change: Array
    distance: Array
    excursion: Array
    mean_change: float
    mean_change_interval: tuple[float, float]
    per_meter: float
    per_meter_interval: tuple[float, float]
    largest: float


def crosstalk(
    c: ArrayLike,
    speed: ArrayLike,
    position: ArrayLike,
    *,
    max_hand_speed: float = 0.05,
    min_distance: float = 0.05,
    resamples: int = 400,
    level: float = 0.95,
    seed: int | np.random.Generator = 0,
) -> Crosstalk:
    """Measure how reaches change the control signal.

    Parameters
    ----------
    c : (T,) array
        Control signal, not clipped; reaches where it is not known are left out.
    speed, position, max_hand_speed, min_distance
        See :func:`ikns.motion.reaches.find_reaches`.
    resamples : int
        Of the block bootstrap over the sequence of reaches; 0 for no intervals. The
        intervals are Student's on the logarithm, as both values are scales.
    level : float
        Confidence.
    seed : int or numpy.random.Generator
        Source of randomness.

    Raises
    ------
    NotEnoughData
        When there is no reach.
    """
    signal, x = np.asarray(c, dtype=np.float64), np.asarray(position, dtype=np.float64)
    if signal.shape != (len(x),):
        raise InvalidInput(
            f"expected one control signal of {len(x)} samples, found {signal.shape}."
        )
    found = find_reaches(
        speed, x, max_hand_speed=max_hand_speed, min_distance=min_distance
    )
    shown = [bool(np.isfinite(signal[a : b + 1]).all()) for a, b in found]
    found = found[np.array(shown, dtype=bool)]
    if not len(found):
        raise NotEnoughData(
            f"expected reaches of {min_distance:g} m or more between rests slower than "
            f"{max_hand_speed:g} m/s, found none."
        )
    before, after = found.T
    change = signal[after] - signal[before]
    distance = np.linalg.norm(x[after] - x[before], axis=1)
    excursion = np.array(
        [np.abs(signal[a : b + 1] - signal[a]).max() for a, b in found]
    )
    size, R = np.abs(change), len(found)
    mean, ratio = float(size.mean()), float(size.sum() / distance.sum())
    intervals = [(np.nan, np.nan)] * 2
    if resamples and R >= 6 and mean > 0:
        scores = np.stack([size, size - ratio * distance], axis=1)
        length, count = blocks_for(scores)
        if length < _LEAST_BLOCK:
            length, count = _LEAST_BLOCK, R / _LEAST_BLOCK
        counts = block_counts(R, length, resamples, np.random.default_rng(seed))
        with np.errstate(divide="ignore"):
            logs = np.log([counts @ size / R, (counts @ size) / (counts @ distance)])
        for i, value in enumerate((mean, ratio)):
            ends = student_interval(np.log(value), logs[i], count, level=level)
            intervals[i] = (float(np.exp(ends[0])), float(np.exp(ends[1])))
    return Crosstalk(
        reaches=found,
        change=change,
        distance=distance,
        excursion=excursion,
        mean_change=mean,
        mean_change_interval=intervals[0],
        per_meter=ratio,
        per_meter_interval=intervals[1],
        largest=float(excursion.max()),
    )
