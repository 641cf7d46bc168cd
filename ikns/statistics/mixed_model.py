"""Linear mixed model: the effect of the condition, with random subjects.

    value = mean + level + condition + condition x level (+ trial) + subject
            + subject x condition + noise

Subjects differ in skill and in the effect of the condition: both are random. Without
the second, a mixed model counts every trial as independent evidence for a difference,
like the paper. Fitted by statsmodels (REML); its normal quantiles are too
narrow for ten persons, so tests of the condition use Student's t with subjects - 1
degrees of freedom, exact in the balanced case, where the test of the condition is the
paired t-test of subject means.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ikns.arrays import Array
from ikns.output.wording import interval_text, number, p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.model_design import comparable_trials, fixed_effects
from ikns.statistics.table import Table

_FULL = "random intercept and condition per subject"
_UNCORRELATED = "random intercept and condition per subject, uncorrelated"
_INTERCEPT = "random intercept per subject"
_CONDITION = "random condition per subject"


@dataclass(frozen=True)
class Coefficient:
    """An estimate with standard error, 95 % interval, two-sided p and degrees."""

    estimate: float
    error: float
    low: float
    high: float
    p: float
    degrees: int


@dataclass(frozen=True)
class MixedModel:
    """A fitted mixed model, or the statement that none converged.

    Parameters
    ----------
    condition : Coefficient or None
        First minus second, mean over levels, in ``unit``; None when nothing converged.
    interaction_p : float
        That the difference is not the same at all levels; NaN with one level.
    trial : Coefficient or None
        Change per trial, in ``unit``.
    subject_deviation, slope_deviation, noise_deviation : float
        Standard deviations of the random parts, in ``unit``; 0 for a part left out.
    structure, message : str
        The random part that was fitted, and why it is not the full one; empty if it is.
    """

    condition: Coefficient | None
    interaction_p: float
    interaction_degrees: tuple[int, int]
    trial: Coefficient | None
    subject_deviation: float
    slope_deviation: float
    noise_deviation: float
    structure: str
    message: str
    trials: int
    subjects: int
    names: tuple[str, str]
    quantity: str
    unit: str
    level: str

    def sentence(self) -> str:
        """Return the result as a sentence."""
        if self.condition is None:
            return f"Mixed model of {self.quantity}: {self.message}."
        c = self.condition
        shown = "differs" if c.p < 0.05 else "is not shown to differ"
        parts = [
            f"Mixed model ({self.structure}, {self.trials} trials of {self.subjects} "
            f"subjects): {self.quantity} {shown} between {self.names[0]} and "
            f"{self.names[1]} (difference {number(c.estimate, self.unit)}, "
            f"{interval_text(c.low, c.high)}, {p_text(c.p)})"
        ]
        if math.isfinite(self.interaction_p):
            shown = "depends" if self.interaction_p < 0.05 else "is not shown to depend"
            parts.append(
                f"the difference {shown} on the {self.level} "
                f"({p_text(self.interaction_p)})"
            )
        if self.trial is not None:
            parts.append(
                f"it changes by {number(self.trial.estimate, self.unit)} a trial "
                f"({interval_text(self.trial.low, self.trial.high)}, "
                f"{p_text(self.trial.p)})"
            )
        if self.message:
            parts.append(self.message)
        return "; ".join(parts) + "."


def mixed_model(
    table: Table,
    value: str,
    *,
    level: str | None = "trajectory",
    trial: str | None = None,
    conditions: Sequence[str] | None = None,
    unit: str = "",
) -> MixedModel:
    """Fit condition x level with random subjects; simpler when that does not converge.

    Tried in order, the first that converges counts: intercept and condition per
    subject; the same uncorrelated; one of the two alone, whichever is likelier. The
    result says which, and why. Trials need not be balanced.

    Parameters
    ----------
    table, value, level, conditions, unit
        As in :func:`pair_trials`.
    trial : str or None
        Column with the number of the trial, for learning.

    Raises
    ------
    InvalidInput, NotEnoughData
        For fewer than 2 subjects, a level without trials of both conditions, a trial
        number that never changes, or values that do not vary.
    """
    trials = comparable_trials(table, value, level, trial, conditions)
    y, people = trials.y, np.unique(trials.subject)
    extra, degrees = len(np.unique(trials.level)) - 1, len(people) - 1
    # Half and minus half: the intercept is then the middle, the slope the difference.
    x = np.where(trials.condition == trials.names[0], 0.5, -0.5)
    design = fixed_effects(trials, x)
    scale = float(y.std(ddof=1))  # statsmodels stops by absolute sizes
    fit, structure, why = _fit((y - y.mean()) / scale, design, x, trials.subject)
    about = {
        "message": why,
        "trials": len(y),
        "subjects": len(people),
        "names": trials.names,
        "quantity": value,
        "unit": unit,
        "level": level or "",
    }
    if fit is None:
        nan = math.nan
        return MixedModel(
            None, nan, (extra, extra * degrees), None, nan, nan, nan, "none", **about
        )
    last = design.shape[1] - 1
    parts = np.sqrt(np.maximum(np.diag(np.atleast_2d(fit.cov_re)), 0.0)) * scale
    own = (0.0, parts[0]) if structure == _CONDITION else (*parts, 0.0)
    return MixedModel(
        condition=_coefficient(fit, 1, degrees, scale),
        interaction_p=_interaction_p(fit, extra, degrees),
        interaction_degrees=(extra, extra * degrees),
        trial=None
        if trial is None
        else _coefficient(fit, last, max(len(y) - last - 1 - 2 * degrees, 1), scale),
        subject_deviation=float(own[0]),
        slope_deviation=float(own[1]),
        noise_deviation=math.sqrt(float(fit.scale)) * scale,
        structure=structure,
        **about,
    )


def _coefficient(fit: Any, index: int, df: int, scale: float) -> Coefficient:
    """Return a fixed effect, in the value's unit."""
    b = float(np.asarray(fit.fe_params)[index])
    e = float(np.sqrt(np.asarray(fit.cov_params())[index, index]))
    half = e * float(stats.t.ppf(0.975, df))
    return Coefficient(
        b * scale,
        e * scale,
        (b - half) * scale,
        (b + half) * scale,
        float(2 * stats.t.sf(abs(b) / e, df)),
        df,
    )


def _interaction_p(fit: Any, extra: int, degrees: int) -> float:
    """Wald's F test that no condition x level effect differs from 0."""
    if not extra:
        return math.nan
    rows = slice(2 + extra, 2 + 2 * extra)
    b = np.asarray(fit.fe_params)[rows]
    wald = b @ np.linalg.solve(np.asarray(fit.cov_params())[rows, rows], b)
    return float(stats.f.sf(wald / extra, extra, extra * degrees))


def _fit(y: Array, design: Array, x: Array, who: NDArray[np.str_]) -> Any:
    """Fit the first structure that converges; its name, and why it is not the full."""
    library = statsmodels("regression.mixed_linear_model")
    both = np.column_stack([np.ones(len(y)), x])
    fixed = np.ones(design.shape[1])
    free = library.MixedLMParams.from_components(fe_params=fixed, cov_re=np.eye(2))

    def fitted(random: Array | None, keep: Any) -> Any:
        with warnings.catch_warnings():
            # Convergence is read from the result below.
            warnings.simplefilter("ignore")
            try:
                fit = library.MixedLM(y, design, who, exog_re=random).fit(
                    reml=True, free=keep, method=["bfgs", "lbfgs"]
                )
                good = bool(fit.converged) and np.all(
                    np.diag(np.asarray(fit.cov_params()))[: design.shape[1]] > 0
                )
            except (np.linalg.LinAlgError, ValueError):
                good = False
        return fit if good else None

    for name, keep in ((_FULL, None), (_UNCORRELATED, free)):
        fit = fitted(both, keep)
        if fit is not None:
            return fit, name, "" if name == _FULL else f"{_FULL} did not converge"
    # With the same fixed effects, restricted likelihoods compare. An intercept alone
    # would count trials as independent evidence even where subjects differ in how the
    # condition suits them.
    alone = [
        (fit.llf, name, fit)
        for name, random in ((_INTERCEPT, None), (_CONDITION, x[:, None]))
        if (fit := fitted(random, None)) is not None
    ]
    if not alone:
        return None, "none", "no mixed model converged, so look at the subject means"
    _, name, fit = max(alone, key=lambda each: each[0])
    return fit, name, f"{_FULL} did not converge"
