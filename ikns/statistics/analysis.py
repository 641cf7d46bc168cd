"""All tests of an experiment at once: the paper's and the additional ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ikns.errors import NotEnoughData
from ikns.output.wording import counted
from ikns.statistics.effects import Effect, effect_sizes
from ikns.statistics.equivalence import Equivalence, equivalence
from ikns.statistics.learning import LearningCurves, learning_curves
from ikns.statistics.mixed_model import MixedModel, mixed_model
from ikns.statistics.paired_tests import (
    Normality,
    PairedT,
    RankTest,
    SignTest,
    exact_sign,
    normality,
    pooled_t,
    signed_rank,
    subject_means_t,
)
from ikns.statistics.pairs import pair_trials
from ikns.statistics.success import SuccessTest, success_pairs, success_test
from ikns.statistics.table import Table, column, labels, two_conditions
from ikns.statistics.times import TimeTest, restricted_pairs, time_test
from ikns.statistics.within_subject_anova import VarianceTable, within_subject_anova

#: statsmodels' table takes minutes for a thousand subjects, as their number cubed.
_MOST_ANOVA = 200


@dataclass(frozen=True)
class TrackingAnalysis:
    """Experiment 1. ``paper`` repeats the paper's tests; the others are additional.

    ``anova`` is None when a subject lacks a trajectory, there is one only, or there are
    more than 200 subjects; ``equivalence`` is None without a declared margin;
    ``learning`` is by condition, and empty without trial numbers.
    """

    paper: tuple[PairedT, Normality]
    subjects: PairedT
    ranks: RankTest
    effects: tuple[Effect, ...]
    model: MixedModel
    anova: VarianceTable | None
    equivalence: Equivalence | None
    learning: dict[str, LearningCurves]

    def sentences(self) -> list[str]:
        """Return the results as sentences, in order."""
        said = [test.sentence() for test in self.paper]
        said += [self.subjects.sentence(), self.ranks.sentence()]
        said += [effect.sentence() for effect in self.effects]
        said.append(self.model.sentence())
        if self.anova is not None:
            said.append(self.anova.sentence())
        said.append(
            "No margin was declared beforehand, so equivalence was not tested."
            if self.equivalence is None
            else self.equivalence.sentence()
        )
        return said + [
            f"{name}: {curves.sentence()}" for name, curves in self.learning.items()
        ]


@dataclass(frozen=True)
class PickAnalysis:
    """Experiment 2. ``paper`` repeats the paper's test; the others are additional.

    Parameters
    ----------
    paper : SignTest or None
        Of times, pairs with a failure left out; None when fewer than 2 remain.
    paper_left_out : int
        Pairs with a failure.
    success : SuccessTest
    time : TimeTest
    ranks, effects
        Of subjects' restricted times; None and empty without spread.
    """

    paper: SignTest | None
    paper_left_out: int
    success: SuccessTest
    time: TimeTest
    ranks: RankTest | None
    effects: tuple[Effect, ...]

    def sentences(self) -> list[str]:
        """Return the results as sentences, in order."""
        said = [
            f"{counted(self.paper_left_out, 'pair')} with a failure left out, as the "
            "paper did, for the next test only."
            if self.paper is not None
            else "Too few pairs without a failure for the paper's sign test."
        ]
        if self.paper is not None:
            said.append(self.paper.sentence())
        said += [self.success.sentence(), self.time.sentence()]
        if self.ranks is not None:
            said.append(self.ranks.sentence())
        return said + [effect.sentence() for effect in self.effects]


def analyze_tracking(
    table: Table,
    *,
    margin: float | None,
    value: str = "rmse",
    level: str = "trajectory",
    trial: str | None = "trial",
    conditions: Sequence[str] | None = None,
    unit: str = "",
    unequal: Literal["refuse", "keep"] = "refuse",
) -> TrackingAnalysis:
    """Run the paper's tests of tracking, and the additional ones.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``condition``, ``trajectory``, ``trial`` and ``rmse``; a row is a
        trial.
    margin : float or None
        Of equivalence, declared before the data were seen, in the unit of the value.
    value, level, trial, conditions, unit, unequal
        As in :func:`pair_trials` and :func:`mixed_model`. Learning curves need six
        trials a person and condition, and are left out where a trial column is None.
    """
    _, names = two_conditions(table, conditions)
    pairs = pair_trials(
        table, value, level=level, conditions=names, unit=unit, unequal=unequal
    )
    means = pairs.subject_means()
    anova: VarianceTable | None = None
    if pairs.subject_count <= _MOST_ANOVA:
        try:
            anova = within_subject_anova(pairs)
        except NotEnoughData:
            anova = None
    return TrackingAnalysis(
        paper=(pooled_t(pairs), normality(pairs)),
        subjects=subject_means_t(pairs),
        ranks=signed_rank(means),
        effects=effect_sizes(pairs),
        model=mixed_model(
            table, value, level=level, trial=trial, conditions=names, unit=unit
        ),
        anova=anova,
        equivalence=None if margin is None else equivalence(pairs, margin=margin),
        learning=_learning(table, value, level, trial, names, unit),
    )


def _learning(
    table: Table,
    value: str,
    level: str,
    trial: str | None,
    names: tuple[str, str],
    unit: str,
) -> dict[str, LearningCurves]:
    """Curves by condition, adjusted for the difficulty of the trajectories."""
    if trial is None:
        return {}
    condition, place = labels(table, "condition"), labels(table, level)
    y = np.asarray(column(table, value), dtype=np.float64)
    curves = {}
    for name in names:
        rows = condition == name
        means = {at: y[rows & (place == at)].mean() for at in np.unique(place[rows])}
        hard = np.array([means[at] for at in place[rows]])
        try:
            curves[name] = learning_curves(
                {
                    "subject": labels(table, "subject")[rows],
                    trial: np.asarray(column(table, trial))[rows],
                    value: y[rows] - hard + y[rows].mean(),
                },
                value,
                trial=trial,
                unit=unit,
            )
        except NotEnoughData:
            continue
    return curves


def analyze_picking(
    table: Table,
    *,
    limit: float,
    conditions: Sequence[str] | None = None,
    unequal: Literal["refuse", "keep"] = "refuse",
) -> PickAnalysis:
    """Run the paper's test of pick and place, and the additional ones.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``condition``, ``object``, ``time`` (s) and ``success``; a row is a
        trial, one per subject, condition and object.
    limit : float
        Time limit of a trial, s.
    conditions, unequal
        As in :func:`pair_trials`.
    """
    outcome = success_pairs(table, conditions=conditions, unequal=unequal)
    asked: dict[str, Any] = {
        "limit": limit,
        "conditions": outcome.names,
        "unequal": unequal,
    }
    timed = time_test(table, **asked)
    pairs = restricted_pairs(table, **asked)
    both = (outcome.first == 1) & (outcome.second == 1)
    try:
        means = pairs.subject_means()
        ranks: RankTest | None = signed_rank(means)
        effects: tuple[Effect, ...] = effect_sizes(pairs)
    except NotEnoughData:
        ranks, effects = None, ()
    whole = replace(
        pairs,
        first=pairs.first[both],
        second=pairs.second[both],
        subjects=pairs.subjects[both],
        levels=pairs.levels[both],
    )
    return PickAnalysis(
        exact_sign(whole) if both.sum() >= 2 else None,
        int(np.sum(~both)),
        success_test(outcome),
        timed,
        ranks,
        effects,
    )
