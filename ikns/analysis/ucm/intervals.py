"""Confidence intervals of dVz over the trials of one person, and over people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from ikns.analysis.ucm.split import VarianceSplit, half_log_ratio, parts
from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.numerics.bootstrap import block_counts, blocks_for, student_interval


@dataclass(frozen=True, eq=False)
class Interval:
    """An estimate with its confidence interval, (...) array each."""

    estimate: Array
    low: Array
    high: Array


def confidence_interval(
    split: VarianceSplit,
    *,
    method: Literal["jackknife", "bootstrap"] = "jackknife",
    block: int | None = None,
    overall: bool = False,
    confidence: float = 0.95,
    n_resamples: int = 1000,
    seed: int | np.random.Generator = 0,
) -> Interval:
    """Confidence interval of dVz for one person.

    ``"jackknife"`` is for trials: it leaves out one at a time and takes Student's t
    with one degree of freedom less than trials (Tukey 1958). ``"bootstrap"`` is for
    correlated samples of one trial: blocks of them are drawn, and their spread is used
    with Student's t (:mod:`ikns.numerics.bootstrap`). The null space is constant in
    both.

    On normal and on heavy-tailed trials of 3 and 7 joints, 8 to 40 of them, 95 %
    intervals of the jackknife held the truth in 91 to 96 % of cases; percentiles of
    trials drawn with replacement, which are therefore not offered, in 81 to 94 %.

    Parameters
    ----------
    split : VarianceSplit
    method : {"jackknife", "bootstrap"}
    block : int, optional
        How many neighbors are drawn together. Default: as the samples' own correlation
        asks for, see :func:`ikns.numerics.bootstrap.blocks_for`.
    overall : bool
        Of the mean of dVz over all (...) instead of each.
    confidence : float
        Of the interval.
    n_resamples, seed : int
        Of the bootstrap.

    Raises
    ------
    InvalidInput
        When a parameter is out of its range.
    NotEnoughData
        When there are fewer than 3 trials or 6 samples, or `overall` finds no finite
        dVz.
    """
    level = check_level(confidence)
    if method not in ("jackknife", "bootstrap"):
        raise InvalidInput(
            f"expected method 'jackknife' or 'bootstrap', found {method!r}."
        )
    n = len(split.deviations)
    if n < 3:
        raise NotEnoughData(f"expected at least 3 trials, found {n}.")
    if method == "jackknife":
        counts = 1.0 - np.eye(n)
    else:
        if block is None:
            length, worth = blocks_for(_influence(split))
        else:
            length, worth = block, n / block
        rng = np.random.default_rng(seed)
        counts = block_counts(n, length, n_resamples, rng)
    shape = np.shape(split.delta_vz)
    estimate = np.reshape(split.delta_vz, -1)
    again = _weighted(split, counts)
    if overall:
        shape, defined = (), np.isfinite(estimate)
        if not defined.any():
            raise NotEnoughData("expected a finite dVz to average, found none.")
        estimate = estimate[defined].mean(keepdims=True)
        again = again[:, defined].mean(axis=1, keepdims=True)
    if method == "jackknife":
        with np.errstate(invalid="ignore"):
            spread = np.sum((again - again.mean(axis=0)) ** 2, axis=0)
            half = stdtrit(n - 1, (1 + level) / 2) * np.sqrt((n - 1) / n * spread)
            low, high = estimate - half, estimate + half
    else:
        low, high = np.transpose(
            [
                student_interval(float(value), drawn, worth, level=level)
                for value, drawn in zip(estimate, again.T, strict=True)
            ]
        )
    return Interval(*(np.reshape(part, shape)[()] for part in (estimate, low, high)))


def _influence(split: VarianceSplit) -> Array:
    """Influence of each sample on dVz where it is finite, (N, times)."""
    n = len(split.deviations)
    along, rest = (
        np.sum(part.reshape(n, -1, part.shape[-1]) ** 2, axis=2)
        for part in parts(split.deviations, split.basis)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = along / along.sum(axis=0) - rest / rest.sum(axis=0)
    moved = moved[:, np.isfinite(moved).all(axis=0)]
    return moved if moved.size else np.zeros((n, 1))


def _weighted(split: VarianceSplit, weights: Array) -> Array:
    """DVz with each trial counted so often, (R, times), for weights (R, N)."""
    n = len(split.deviations)
    known = weights @ split.seen.reshape(n, -1).astype(np.float64)
    totals = []
    for part in parts(split.deviations, split.basis):
        rows = part.reshape(n, known.shape[1], -1)
        sums = np.einsum("rn,ntj->rtj", weights, rows, optimize=True)
        raw = weights @ np.sum(rows**2, axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            totals.append(raw - np.sum(sums**2, axis=2) / known)
    return half_log_ratio(*totals)


def mean_interval(values: ArrayLike, *, confidence: float = 0.95) -> Interval:
    """Mean over people with its t-interval.

    Parameters
    ----------
    values : (people, ...) array
        One dVz a person, such as the mean over time; nearly normal, as dV is not.
    confidence : float
        Of the interval.

    Raises
    ------
    NotEnoughData
        With fewer than two people.

    Examples
    --------
    >>> found = mean_interval([1.0, 2.0, 3.0])
    >>> found.low.round(3), found.high.round(3)
    (np.float64(-0.484), np.float64(4.484))
    """
    people = np.asarray(values, dtype=np.float64)
    if people.ndim < 1 or len(people) < 2:
        raise NotEnoughData(
            f"expected values of at least 2 people, found an array {people.shape}."
        )
    mean = people.mean(axis=0)
    error = people.std(axis=0, ddof=1) / np.sqrt(len(people))
    half = stdtrit(len(people) - 1, (1 + check_level(confidence)) / 2) * error
    return Interval(mean, mean - half, mean + half)


def check_level(confidence: float) -> float:
    """Refuse a confidence that is not between 0 and 1."""
    if not 0 < confidence < 1:
        raise InvalidInput(f"expected a confidence inside 0 to 1, found {confidence}.")
    return confidence
