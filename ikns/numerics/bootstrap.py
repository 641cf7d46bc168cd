"""Confidence intervals of statistics of a time series: the block bootstrap.

Samples of a movement are correlated in time, so drawing them one by one would
overestimate their number. Blocks of neighbors are drawn instead, wrapping around the
end (circular block bootstrap, Politis and Romano 1992), with a length that follows from
the autocorrelation of the series (:func:`blocks_for`).

A few seconds hold only a few blocks. Then a standard error from blocks is too small and
itself uncertain, and percentiles of the replicates are too narrow. So replicates only
give the standard error; it is corrected for its bias and used with Student's quantile:
for k blocks the error's variance is ``1 - 1/k + 1/(3 k^2)`` of what it should be and
has 1.5 k degrees of freedom, like a Bartlett-window estimate with a bandwidth of one
block (Priestley 1981, Spectral analysis and time series, table 6.2). This
reproduces the critical values of Kiefer and Vogelsang (2005, Econometric Theory
21:1130) to 7 %.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from ikns.arrays import Array, Indices
from ikns.errors import InvalidInput, NotEnoughData

#: Fewer samples are no series.
_FEWEST = 6
#: Least number of blocks that are drawn. So few hardly determine their own spread,
#: which Student's quantile allows for; shorter blocks would not see a drift, which
#: nothing allows for.
_LEAST_BLOCKS = 1.5
#: Share of the variance that may be lost at block ends. The correlation is estimated
#: too, and intervals that miss are of series in which it seemed short: with a twentieth
#: those of the mean of a drift hold 89 to 92 %, with this 92 to 95.
_BIAS = 0.025
#: A drift that asks for longer blocks than can be drawn counts for fewer, down to one:
#: intervals hold 94 % for a drift whose memory is 30 % of the series, 88 for 60.
#: Counted as 1.25 at least, which makes them a third shorter, they held 90 and 79.
_FEWEST_COUNTED = 1.0


class Blocks(NamedTuple):
    """How a series is cut into blocks."""

    length: int  # samples that are drawn together
    worth: float  # how many such blocks the series is worth


def blocks_for(series: ArrayLike) -> Blocks:
    """Blocks for a series (N,) or (N, m), of 1 sample to two thirds of N.

    Blocks cut correlations at their ends. The relative bias of a variance from blocks
    of length b is therefore ``-G / (g(0) b)``, where g(0) is the long-run variance, the
    sum of all autocovariances R(k), and G the sum of ``|k| R(k)``. The length returned
    makes that bias a fortieth. Both sums run over lags up to twice the one beyond
    which autocorrelations are only noise, with a flat-top window (Politis and White
    2004, Econometric Reviews 23:53; corrected by Patton, Politis and White 2009,
    28:372); that lag is sought up to half the series, so that blocks follow a drift.
    The length they recommend, which grows with the cube root of N, has the least mean
    squared error of the variance; intervals keep their level with longer blocks, while
    the small number of blocks is allowed for (Sun, Phillips and Jin 2008, Econometrica
    76:175).

    For several columns the longest block length is used. For a statistic that is not a
    mean, pass the influence of each sample.

    >>> rng = np.random.default_rng(0)
    >>> blocks_for(rng.normal(size=1000)).length < 20
    True
    >>> blocks_for(np.cumsum(rng.normal(size=1000))).worth < 2
    True
    """
    rows = np.asarray(series, dtype=np.float64)
    rows = rows.reshape(len(rows), -1)
    n = len(rows)
    if n < _FEWEST:
        raise NotEnoughData(
            f"expected at least {_FEWEST} samples to draw blocks from, found {n}."
        )
    wanted = max(_length_of_one(column) for column in rows.T)
    length = min(wanted, int(n / _LEAST_BLOCKS))
    # What is lost beyond the longest blocks is not to be had from longer ones.
    return Blocks(length, min(n / length, max(n / wanted, _FEWEST_COUNTED)))


def _length_of_one(x: Array) -> int:
    """Length that a single series (N,) asks for, which may be beyond N."""
    n = len(x)
    deviation = x - x.mean()
    if not np.abs(deviation).max() > 1e-12 * np.abs(x).max():
        return 1
    quiet = max(5, math.ceil(math.sqrt(math.log10(n))))
    lags = min(max(math.ceil(math.sqrt(n)) + quiet, n // 2), n - 1)
    spectrum = np.abs(np.fft.rfft(deviation, 2 * n)) ** 2
    R = np.fft.irfft(spectrum, 2 * n)[: lags + 1] / n
    noise = 2 * math.sqrt(math.log10(n) / n)
    small = np.abs(R[1:] / R[0]) < noise
    runs = np.flatnonzero(np.convolve(small, np.ones(quiet), "valid") > quiet - 0.5)
    # The first lag beyond which all is noise; else the last that is not.
    last = int(runs[0] if runs.size else np.flatnonzero(~small).max(initial=0) + 1)
    reach = min(2 * max(last, 1), lags)
    k = np.arange(1, reach + 1)
    window = np.clip(2 * (1 - k / reach), 0.0, 1.0)  # a trapezoid: flat, then down
    g0 = R[0] + 2 * float(np.sum(window * R[1 : reach + 1]))
    G = 2 * float(np.sum(window * k * R[1 : reach + 1]))
    if g0 <= 0:
        return 1  # a mean that varies less than one of independent samples
    return max(1, math.ceil(abs(G) / (g0 * _BIAS)))


def block_rows(
    n: int, length: int, resamples: int, rng: np.random.Generator
) -> Indices:
    """Draw blocks of neighboring rows of `n`, wrapping around the end, (resamples, n).

    The last block of each series is cut to fit.

    >>> block_rows(4, 4, 1, np.random.default_rng(3)).tolist()
    [[3, 0, 1, 2]]
    """
    starts = _block_starts(n, length, resamples, rng)
    rows = (starts[:, :, None] + np.arange(length)) % n
    return rows.reshape(resamples, -1)[:, :n]


def _block_starts(
    n: int, length: int, resamples: int, rng: np.random.Generator
) -> Indices:
    """First rows of blocks that together are at least `n` long, (resamples, k)."""
    if not (1 <= length <= n and resamples >= 1):
        raise InvalidInput(
            f"expected blocks of 1 to {n} rows and at least one resample, found "
            f"{length} and {resamples}."
        )
    return rng.integers(n, size=(resamples, -(-n // length)))


def block_counts(
    n: int, length: int, resamples: int, rng: np.random.Generator
) -> Array:
    """How often each row is drawn by :func:`block_rows`, (resamples, n).

    Sums over the drawn rows are products with this matrix.
    """
    starts = _block_starts(n, length, resamples, rng)
    ends = starts + length
    ends[:, -1] -= starts.shape[1] * length - n
    # A block adds one from its start on and takes it off at its end; of one that goes
    # on at the beginning, the one is there before its start as well.
    rows = np.stack([starts, ends % n]) + n * np.arange(resamples)[:, None]
    sign = np.repeat([1.0, -1.0], starts.size)
    steps: Array = np.asarray(np.bincount(rows.ravel(), sign, n * resamples), float)
    counts = steps.reshape(resamples, n)
    counts[:, 0] += np.sum(ends >= n, axis=1)
    return np.cumsum(counts, axis=1, out=counts)


def student_interval(
    estimate: float, replicates: ArrayLike, blocks: float, *, level: float = 0.95
) -> tuple[float, float]:
    """Confidence interval of a number from the spread of its bootstrap replicates.

    `blocks` is how many blocks the series is worth. Replicates (B,) that are not finite
    are ignored; with fewer than two others the interval is NaN.
    """
    values = np.asarray(replicates, dtype=np.float64)
    values = values[np.isfinite(values)]
    if len(values) < 2 or not math.isfinite(estimate):
        return math.nan, math.nan
    degrees, widen = _small_sample(blocks)
    quantile = stdtrit(degrees, (1 + level) / 2)  # Student's t
    half = quantile * widen * values.std(ddof=1)
    return estimate - half, estimate + half


class LengthEstimate(NamedTuple):
    """Length of a vector that noise made longer: corrected, and its interval's ends."""

    corrected: float
    low: float
    high: float


def length_interval(
    estimate: ArrayLike,
    replicates: ArrayLike,
    blocks: float,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
) -> tuple[float, float]:
    """Confidence interval of a vector's length; see :func:`length_estimate`."""
    found = length_estimate(estimate, replicates, blocks, rng=rng, level=level)
    return found.low, found.high


def length_estimate(
    estimate: ArrayLike,
    replicates: ArrayLike,
    blocks: float,
    *,
    rng: np.random.Generator,
    level: float = 0.95,
) -> LengthEstimate:
    """Length of a vector that noise makes longer, corrected, with its interval.

    The length of a noisy vector is never zero, even where that of the true one is; so
    replicates scatter around too long a length. The interval instead holds all lengths
    r that a test does not reject: true vectors of length r in the direction found, with
    the errors of the replicates, widened as in :func:`student_interval` (test
    inversion, Carpenter 1999, Statistics in Medicine 18:1). The corrected length is the
    r with which the vector would be longer half of the time, so it lies within.

    The estimate is (m,); rows of the replicates (B, m) that are not finite are ignored.
    Corrected length and lower end are 0 where the vector is within its noise. A vector
    that is shorter than noise alone would make it half of the time has the upper end of
    one that long (Cowan et al. 2011, arXiv 1105.3166): without that the interval
    could be empty.
    """
    vector = np.asarray(estimate, dtype=np.float64)
    rows = np.asarray(replicates, dtype=np.float64).reshape(-1, len(vector))
    rows = rows[np.isfinite(rows).all(axis=1)]
    length = float(np.linalg.norm(vector))
    if len(rows) < 2 or not math.isfinite(length):
        return LengthEstimate(math.nan, math.nan, math.nan)
    degrees, widen = _small_sample(blocks)
    errors = widen * (rows - rows.mean(axis=0))
    errors *= np.sqrt(degrees / rng.chisquare(degrees, len(rows)))[:, None]
    along = errors @ (vector / length) if length > 0 else errors[:, 0]
    squared = np.sum(errors**2, axis=1)
    usual = max(length, float(np.sqrt(np.median(squared))))
    upper, lower = (1 + level) / 2, (1 - level) / 2
    return LengthEstimate(
        # Noise makes a length longer, not shorter, but for the luck of few replicates.
        corrected=min(_longest(length, along, squared, 0.5), length),
        low=min(_longest(length, along, squared, upper), length),
        high=_longest(usual, along, squared, lower),
    )


def _longest(length: float, along: Array, squared: Array, share: float) -> float:
    """Return the longest true vector of which `share` are found shorter than `length`.

    Errors (B,) have a part `along` the vector, and are `squared`; 0 if there is none.
    """
    # A vector of length r and an error e make one shorter than `length` exactly while
    # r lies between the roots of r^2 + 2 r along + squared = length^2.
    discriminant = along**2 - squared + length**2
    root = np.sqrt(discriminant[discriminant >= 0])
    along = along[discriminant >= 0]
    first, last = np.sort(-along - root), np.sort(root - along)
    # The share of shorter vectors changes only at these lengths.
    lengths = np.unique(np.concatenate([[0.0], first, last]))
    lengths = lengths[lengths >= 0]
    shorter = np.searchsorted(first, lengths, "right") - np.searchsorted(last, lengths)
    return float(lengths[shorter >= share * len(squared)].max(initial=0.0))


def _small_sample(blocks: float) -> tuple[float, float]:
    """Degrees of freedom, and factor on a standard error, for a number of blocks."""
    k = max(float(blocks), 1.0)
    return 1.5 * k, (1 - 1 / k + 1 / (3 * k * k)) ** -0.5
