"""Learning over trials: an exponential, a power law, or neither.

    constant      y = a
    exponential   y = a + b exp(-(k - 1) / tau)
    power law     y = a + b k^-c

k = 1, 2, ... counts trials. Every person has a level a of their own. Gain b and rate
are shared, since nine trials do not give each person a rate; or fitted per person,
since the mean of exponentials that differ looks like a power law (Heathcote, Brown and
Mewhort 2000, Psychon Bull Rev 7:185). The models are compared by AICc (Hurvich and Tsai
1989, Biometrika 76:297), summed over persons where they are fitted one by one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.output.wording import number
from ikns.statistics.table import Table, column, finite_values, labels

MODELS = ("constant", "exponential", "power law")
#: Trials a person needs: AICc of four parameters (with the noise) is finite from 6 on.
LEAST_TRIALS = 6


@dataclass(frozen=True)
class LearningCurve:
    """One model fitted to one person, or to all.

    Parameters
    ----------
    subject : str
        ``all`` where gain and rate are shared.
    final, gain : float
        a, the asymptote, mean over persons, and b, above that at the first trial (0 for
        the constant), in the value's unit.
    rate : float
        tau in trials, or the exponent c; NaN for the constant.
    deviation : float
        Root mean square of the residuals.
    """

    model: str
    subject: str
    final: float
    gain: float
    rate: float
    deviation: float
    aicc: float

    def at(self, trial: Array) -> Array:
        """Value at trials 1, 2, ... (K,), in the value's unit."""
        if self.model == "exponential":
            return np.asarray(self.final + self.gain * np.exp(-(trial - 1) / self.rate))
        if self.model == "power law":
            return np.asarray(self.final + self.gain * trial**-self.rate)
        return np.full(len(trial), self.final)


@dataclass(frozen=True)
class LearningCurves:
    """All fits and what they add up to.

    Parameters
    ----------
    curves : tuple of LearningCurve
        Every model, of every person if fitted one by one.
    aicc, weights : dict
        By model; weights are shares of the evidence (Akaike weights), sum 1.
    """

    curves: tuple[LearningCurve, ...]
    aicc: dict[str, float]
    weights: dict[str, float]
    best: str
    subjects: int
    trials: int
    quantity: str
    unit: str

    def sentence(self) -> str:
        """Return the result as a sentence that names models nearly as good."""
        near = [
            m
            for m in MODELS
            if m != self.best and self.aicc[m] - self.aicc[self.best] < 2
        ]
        what = {
            "constant": "no model of learning describes it better than a constant",
            "exponential": "an exponential describes it best",
            "power law": "a power law describes it best",
        }[self.best]
        also = f", with {' and '.join(near)} nearly as good" if near else ""
        gains = [c.gain for c in self.curves if c.model == self.best]
        gain = (
            ""
            if self.best == "constant"
            else f"; median gain {number(float(np.median(gains)), self.unit)}"
        )
        weights = ", ".join(f"{m} {self.weights[m]:.2f}" for m in MODELS)
        return (
            f"{self.quantity} over {self.trials} trials of {self.subjects} subjects: "
            f"{what}{also} (weights {weights}{gain})."
        )


def learning_curves(
    table: Table,
    value: str,
    *,
    trial: str = "trial",
    unit: str = "",
    per_person: bool = False,
) -> LearningCurves:
    """Fit and compare learning curves.

    Parameters
    ----------
    table : mapping of columns
        With ``subject``, the number of the trial (from 1) and the value; of one
        condition, and of tasks that are equally hard in every trial.
    value, trial : str
        Columns.
    unit : str
        Of the value.
    per_person : bool
        Fit gain and rate to each person instead of to all.

    Raises
    ------
    InvalidInput
        For trial numbers below 1.
    NotEnoughData
        With fewer than 6 trials of a person, or values that are all the same.
    """
    y = finite_values(column(table, value), value)
    k = finite_values(column(table, trial), trial)
    who = labels(table, "subject")
    if not len(y):
        raise NotEnoughData("expected trials, found none.")
    if k.min() < 1:
        raise InvalidInput(f"expected trials counted from 1, found {k.min():g}.")
    people = np.unique(who)
    for person in people:
        rows = who == person
        if len(np.unique(k[rows])) < LEAST_TRIALS:
            raise NotEnoughData(
                f"expected at least {LEAST_TRIALS} trials of subject {str(person)!r}, "
                f"found {len(np.unique(k[rows]))}."
            )
        if np.ptp(y[rows]) <= 1e-12 * np.abs(y[rows]).max():
            raise NotEnoughData(
                f"expected values of subject {str(person)!r} that vary, found "
                f"{int(rows.sum())} times {y[rows][0]:g}."
            )
    groups = [(str(p), who == p) for p in people] if per_person else []
    curves = [
        _fit(model, k[rows], y[rows], who[rows], name)
        for name, rows in groups or [("all", np.full(len(y), True))]
        for model in MODELS
    ]
    aicc = {m: math.fsum(c.aicc for c in curves if c.model == m) for m in MODELS}
    best = min(MODELS, key=lambda m: aicc[m])
    raw = {m: math.exp(-(aicc[m] - aicc[best]) / 2) for m in MODELS}
    weights = {m: raw[m] / sum(raw.values()) for m in MODELS}
    return LearningCurves(
        tuple(curves), aicc, weights, best, len(people), len(y), value, unit
    )


def _fit(
    model: str, k: Array, y: Array, who: NDArray[np.str_], name: str
) -> LearningCurve:
    """Least squares: levels and gain are linear, the rate is searched on its log.

    Levels drop out where every person's mean is taken away (Frisch and Waugh 1933).
    """
    _, person = np.unique(who, return_inverse=True)
    counts = np.bincount(person)
    people, gain, rate = len(counts), 0.0, math.nan

    def centered(values: Array) -> Array:
        means = np.bincount(person, values) / counts
        return np.asarray(values - means[person], dtype=np.float64)

    def curve(log_rate: float) -> Array:
        r = math.exp(log_rate)
        return np.exp(-(k - 1) / r) if model == "exponential" else k**-r

    def solve(log_rate: float) -> tuple[float, float]:
        x = centered(curve(log_rate))
        b = float(x @ rest / (x @ x))
        return b, float(np.sum((rest - b * x) ** 2))

    rest = centered(y)
    if model == "constant":
        left, parameters = float(rest @ rest), people + 1  # with the noise
        final = y
    else:
        # From learning within one trial to learning that continues at the end.
        low, high = (
            (math.log(0.2), math.log(5 * k.max()))
            if model == "exponential"
            else (math.log(0.05), math.log(8.0))
        )
        grid = np.linspace(low, high, 25)
        at = int(np.argmin([solve(r)[1] for r in grid]))
        found = optimize.minimize_scalar(
            lambda r: solve(r)[1],
            bounds=(grid[max(at - 1, 0)], grid[min(at + 1, len(grid) - 1)]),
            method="bounded",
            options={"xatol": 1e-8},
        )
        gain, left = solve(float(found.x))
        rate, parameters = math.exp(float(found.x)), people + 3
        final = y - gain * curve(float(found.x))
    n = len(y)
    # A perfect fit has no noise: rounding replaces it.
    noise = max(left / n, (1e-12 * float(np.abs(y).max())) ** 2)
    aicc = n * math.log(noise) + 2 * parameters * n / (n - parameters - 1)
    return LearningCurve(
        model,
        name,
        float(np.mean(np.bincount(person, final) / counts)),
        gain,
        rate,
        math.sqrt(left / n),
        aicc,
    )
