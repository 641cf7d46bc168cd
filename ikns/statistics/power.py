"""How many participants: power by simulation for a difference and a declared margin.

The difference of a trial of the first condition from one of the second is

    d = difference + subject + subject x level + trial of first - trial of second

all normal and independent. Averaging over trials and trajectories reduces their parts
of the noise, but not that of the subjects, which only more participants reduce.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.output.wording import number
from ikns.statistics.equivalence import checked_margin

Analysis = Literal["subject means", "pooled"]
#: Largest number of normal draws held at once.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class Design:
    """How many subjects, levels (trajectories or objects) each, repeats of each."""

    subjects: int
    levels: int = 3
    repeats: int = 3

    def __post_init__(self) -> None:
        """Refuse impossible designs."""
        if self.subjects < 2 or self.levels < 1 or self.repeats < 1:
            raise InvalidInput(
                "expected at least 2 subjects, 1 level and 1 repeat, found "
                f"{self.subjects}, {self.levels} and {self.repeats}."
            )


@dataclass(frozen=True)
class Spread:
    """Standard deviations, in the unit of the difference.

    ``subject`` is that of the difference from subject to subject, ``level`` that from
    level to level within a subject, ``trial`` that of repeats of one condition.
    """

    subject: float
    level: float = 0.0
    trial: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not a spread."""
        parts = (self.subject, self.level, self.trial)
        if not all(math.isfinite(s) and s >= 0 for s in parts) or not any(parts):
            raise InvalidInput(
                "expected standard deviations of 0 or more, one above 0, found "
                f"{self.subject:g}, {self.level:g} and {self.trial:g}."
            )

    def of_subject_mean(self, design: Design) -> float:
        """Return the standard deviation of a subject's mean difference."""
        return math.sqrt(
            self.subject**2
            + self.level**2 / design.levels
            + 2 * self.trial**2 / (design.levels * design.repeats)
        )


@dataclass(frozen=True)
class Power:
    """Share of simulated studies that reach their aim.

    Parameters
    ----------
    error, low, high : float
        Monte Carlo standard error and 95 % interval (Clopper and Pearson) of ``power``.
    aim : "equivalence" or "difference"
    difference : float
        True one.
    """

    power: float
    error: float
    low: float
    high: float
    aim: str
    margin: float | None
    difference: float
    design: Design
    analysis: str
    alpha: float
    simulations: int
    seed: int

    def sentence(self) -> str:
        """Return the result as a sentence."""
        what = (
            f"equivalence within {number(self.margin)}"
            if self.margin is not None
            else "a difference"
        )
        d = self.design
        return (
            f"With {d.subjects} subjects, {d.levels} levels and {d.repeats} repeats, "
            f"and a true difference of {number(self.difference)}, {what} is shown in "
            f"{100 * self.power:.1f} % of {self.simulations} simulated studies (95 % "
            f"interval {100 * self.low:.1f} to {100 * self.high:.1f} %, analysis by "
            f"{self.analysis}, seed {self.seed})."
        )


def simulated_power(
    design: Design,
    spread: Spread,
    *,
    difference: float = 0.0,
    margin: float | None = None,
    alpha: float = 0.05,
    analysis: Analysis = "subject means",
    simulations: int = 10_000,
    seed: int = 0,
) -> Power:
    """Simulate studies and count those that reach their aim.

    Parameters
    ----------
    design : Design
    spread : Spread
    difference : float
        True mean difference.
    margin : float, optional
        Aim at equivalence within it (two one-sided t-tests); without, at a difference
        (two-sided t-test), which with a true difference of 0 is the error of the first
        kind.
    alpha : float
    analysis : "subject means" or "pooled"
        The latter counts subjects x levels as independent, as the paper did.
    simulations, seed : int

    Raises
    ------
    InvalidInput
        For a margin that is not above 0, alpha outside (0, 0.5), no simulations.

    Examples
    --------
    >>> ten = simulated_power(Design(10), Spread(subject=1.0), difference=1.0)
    >>> round(ten.power, 1)
    0.8
    """
    if margin is not None:
        margin = checked_margin(margin)
    if not 0 < alpha < 0.5:
        raise InvalidInput(f"alpha must be between 0 and 0.5, found {alpha:g}.")
    if simulations < 1:
        raise InvalidInput(f"expected at least 1 simulation, found {simulations}.")
    if not math.isfinite(difference):
        raise InvalidInput(f"expected a finite difference, found {difference}.")
    if analysis not in ("subject means", "pooled"):
        raise InvalidInput(
            f"expected analysis 'subject means' or 'pooled', found {analysis!r}."
        )
    rng = np.random.default_rng(seed)
    cells = design.subjects * design.levels
    step = max(_CHUNK // cells, 1)
    reached = 0
    for start in range(0, simulations, step):
        count = min(step, simulations - start)
        d = difference + _draw(count, design, spread, rng)
        rows = d.mean(axis=2) if analysis == "subject means" else d.reshape(count, -1)
        if margin is None:
            p = stats.ttest_1samp(rows, 0.0, axis=1).pvalue
        else:
            p = np.maximum(
                stats.ttest_1samp(rows, -margin, axis=1, alternative="greater").pvalue,
                stats.ttest_1samp(rows, margin, axis=1, alternative="less").pvalue,
            )
        reached += int(np.sum(p < alpha))
    test = stats.binomtest(reached, simulations)
    interval = test.proportion_ci(0.95, method="exact")
    share = reached / simulations
    return Power(
        power=share,
        error=math.sqrt(share * (1 - share) / simulations),
        low=float(interval.low),
        high=float(interval.high),
        aim="difference" if margin is None else "equivalence",
        margin=margin,
        difference=float(difference),
        design=design,
        analysis=analysis,
        alpha=alpha,
        simulations=simulations,
        seed=seed,
    )


def _draw(
    count: int, design: Design, spread: Spread, rng: np.random.Generator
) -> Array:
    """Mean differences over repeats around 0, (count, subjects, levels)."""
    n, k, r = design.subjects, design.levels, design.repeats
    d = spread.subject * rng.standard_normal((count, n, 1))
    d = d + spread.level * rng.standard_normal((count, n, k))
    # The mean of r normal trials less that of r others is one normal number.
    trials = rng.standard_normal((count, n, k))
    return np.asarray(d + spread.trial * math.sqrt(2 / r) * trials)
