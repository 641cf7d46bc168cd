"""How sure: intervals of dVz over the trials of one person, and over people."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

from ikns.errors import InvalidInput, NotEnoughData
from ikns.ucm.split import VarianceSplit, half_log_ratio, parts

__all__ = ["Interval", "confidence_interval", "mean_interval"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Interval:
    """An estimate with its confidence interval.

    Parameters
    ----------
    estimate, low, high : (...) array
    """

    estimate: Array
    low: Array
    high: Array


def confidence_interval(
    split: VarianceSplit,
    *,
    method: Literal["jackknife", "bootstrap"] = "jackknife",
    confidence: float = 0.95,
    block: int = 1,
    overall: bool = False,
    n_resamples: int = 2000,
    seed: int | np.random.Generator = 0,
) -> Interval:
    """Confidence interval of dVz over the trials of one person.

    ``"jackknife"`` leaves out one trial at a time and takes Student's t with one degree
    of freedom less than trials (Tukey 1958); ``"bootstrap"`` draws trials with
    replacement and takes percentiles. On normal and on heavy-tailed trials of 3 and 7
    joints, 8 to 40 of them, 95 % intervals of the jackknife held the truth in 91 to
    96 % of cases, those of the bootstrap in 81 to 94 %. The null space is held where it
    is in both.

    Parameters
    ----------
    split : VarianceSplit
    method : {"jackknife", "bootstrap"}
    confidence : float
        Of the interval.
    block : int
        How many neighbors along the first axis go together: 1 for trials; for samples
        of one trial, as many as resemble each other.
    overall : bool
        Of the mean of dVz over all (...) instead of each.
    n_resamples : int
        Of the bootstrap.
    seed : int or numpy.random.Generator
        Of the bootstrap.

    Returns
    -------
    Interval

    Raises
    ------
    InvalidInput
        When a parameter is out of its range.
    NotEnoughData
        When there are fewer than three blocks, or `overall` finds no finite dVz.
    """
    level = check_level(confidence)
    if method not in ("jackknife", "bootstrap") or block < 1 or n_resamples < 1:
        raise InvalidInput(
            "expected method 'jackknife' or 'bootstrap' with block and n_resamples of "
            f"at least 1, found {method!r}, {block} and {n_resamples}."
        )
    n = len(split.deviations)
    n_blocks = round(n / block)
    if n_blocks < 3:
        raise NotEnoughData(
            f"expected at least 3 blocks of {block}, found {n} along the first axis."
        )
    member = np.arange(n) * n_blocks // n
    if method == "jackknife":
        counts = 1.0 - np.eye(n_blocks)
    else:
        rng, even = np.random.default_rng(seed), np.full(n_blocks, 1 / n_blocks)
        counts = rng.multinomial(n_blocks, even, n_resamples).astype(np.float64)
    estimate = split.delta_vz
    again = _weighted(split, counts[:, member])
    again = again.reshape(len(again), *np.shape(estimate))
    if overall:
        defined = np.isfinite(estimate)
        if not defined.any():
            raise NotEnoughData("expected a finite dVz to average, found none.")
        estimate, again = estimate[defined].mean(), again[:, defined].mean(axis=1)
    with np.errstate(invalid="ignore"):
        if method == "jackknife":
            spread = np.sum((again - again.mean(axis=0)) ** 2, axis=0)
            error = np.sqrt((n_blocks - 1) / n_blocks * spread)
            half = stdtrit(n_blocks - 1, (1 + level) / 2) * error
            return Interval(estimate, estimate - half, estimate + half)
        edges = [(1 - level) / 2, (1 + level) / 2]
        # A resample of one trial alone has no variance and does not count.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            low, high = np.nanquantile(again, edges, axis=0)
    return Interval(estimate, low, high)


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
