"""Summary of tracking: tables, error over time, statistics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.errors import IknsError
from ikns.experiments.study.summary.accumulate import VisitAccumulator
from ikns.experiments.study.summary.means import ConditionMean, condition_means
from ikns.experiments.study.summary.running_error import ErrorOverTime
from ikns.experiments.study.summary.trials import (
    Columns,
    paired_subjects,
    rows_of,
    select,
    study_conditions,
)
from ikns.experiments.study.summary.variations import VariationMean, compare_variations
from ikns.experiments.tracking import TrackingRecord
from ikns.experiments.visits import read_visit, tracking_record
from ikns.statistics import TrackingAnalysis, analyze_tracking

#: Units of the metrics in tables.
UNITS = {
    "rmse": "of 100",
    "mae": "of 100",
    "lag": "s",
    "overshoot": "of 100",
    "smoothness": "no unit",
    "unseen": "%",
}


@dataclass(frozen=True)
class TrackingComparison:
    """Comparison of two conditions, or the reason why there is none.

    Parameters
    ----------
    names : (str, str)
        Every difference is the first minus the second.
    analysis : TrackingAnalysis or None
    why : str
        "Not tested: ..." where there is no analysis.
    subjects : int
        Number of subjects with trials in both conditions.
    alone : int
        Number of trajectories that a participant did in one condition only; they are in
        no paired test.
    """

    names: tuple[str, str]
    analysis: TrackingAnalysis | None
    why: str
    subjects: int
    alone: int


@dataclass(frozen=True, eq=False)
class TrackingSummary:
    """Results of experiment 1, of people or of simulated participants.

    Parameters
    ----------
    simulated : bool
    participants : list of str
        Participants of the variation ``base``, with or without a trial.
    base : str
        The variation that all results but ``varied`` are of.
    conditions, trajectories : list of str
    table : dict of str to array
        Measured trials of all variations, training included, one per row.
    attempts : Counter
        By (condition, kind, outcome), all variations.
    rmse : list of ConditionMean
        By condition and trajectory; the last level of each condition is all of them.
    metrics : dict of str to list of ConditionMean
        The other metrics of ``UNITS``, likewise.
    errors : dict of (condition, trajectory) to ErrorOverTime
    comparisons : tuple of Comparison
        The first condition with each other one.
    varied : list of VariationMean
        Empty with one variation.
    margin : float or None
        Margin of equivalence in the study file, of 100.
    settings : list of dict
        Designs, versions and inputs of the visits.
    unmeasured : list of str
        Trials with less than a second of control signal.
    redrawn : int
        Number of simulated persons replaced because they could not do the protocol.
    faults : list of str
        Why simulated persons could not take part.
    sessions : dict
        Recordings of the visits, relative to them, by (variation, participant).
    folders : dict
        Folders of the visits, likewise.
    """

    simulated: bool
    participants: list[str]
    base: str
    conditions: list[str]
    trajectories: list[str]
    table: dict[str, NDArray[Any]]
    attempts: Counter[tuple[str, str, str]]
    rmse: list[ConditionMean]
    metrics: dict[str, list[ConditionMean]]
    errors: dict[tuple[str, str], ErrorOverTime]
    comparisons: tuple[TrackingComparison, ...]
    varied: list[VariationMean]
    margin: float | None
    settings: list[dict[str, Any]]
    unmeasured: list[str]
    redrawn: int
    faults: list[str]
    sessions: dict[tuple[str, str], str] = field(repr=False)
    folders: dict[tuple[str, str], Path] = field(repr=False)

    def trials(self, kind: str = "trial") -> dict[str, NDArray[Any]]:
        """Return the rows of the base variation and of one kind."""
        return rows_of(self.table, kind=kind, variation=self.base)

    def median_trial(
        self, condition: str, trajectory: str
    ) -> tuple[TrackingRecord, str, float] | None:
        """Return the trial whose RMSE is nearest the median, read from disk.

        Returns
        -------
        (record, participant, rmse), or None without a trial
        """
        trials = self.trials()
        rows = np.flatnonzero(
            (trials["condition"] == condition) & (trials["trajectory"] == trajectory)
        )
        if not len(rows):
            return None
        rmse = trials["rmse"][rows]
        # With an even count the lower of the middle two, so that it is a real trial.
        row = rows[np.argsort(rmse, kind="stable")[(len(rows) - 1) // 2]]
        who = str(trials["subject"][row])
        visit = read_visit(self.folders[self.base, who])
        attempt = visit.attempts[int(trials["number"][row]) - 1]
        return tracking_record(attempt), who, float(trials["rmse"][row])


def summarize_tracking(
    visits: VisitAccumulator, plan: Mapping[str, Any]
) -> TrackingSummary:
    """Compute tables and statistics.

    Parameters
    ----------
    visits : VisitAccumulator
        Of experiment tracking.
    plan : mapping
        Table ``tracking`` of the study file; empty without one.
    """
    table, margin = visits.table(), plan.get("margin")
    tested = rows_of(table, kind="trial", variation=visits.base)
    conditions = study_conditions(table, [c for c, _, _ in visits.attempts], plan)
    trajectories = sorted(set(table["trajectory"].tolist()))
    order = {"conditions": conditions, "levels": trajectories}
    in_percent = {**tested, "unseen": 100 * tested["unseen"].astype(float)}
    return TrackingSummary(
        **visits.summary_fields(),
        conditions=conditions,
        trajectories=trajectories,
        table=table,
        rmse=condition_means(tested, "rmse", level="trajectory", **order),
        metrics={
            name: condition_means(in_percent, name, level="trajectory", **order)
            for name in UNITS
            if name != "rmse"
        },
        errors=visits.error_over_time(),
        comparisons=tuple(
            _compare(tested, (conditions[0], other), margin) for other in conditions[1:]
        ),
        varied=compare_variations(
            select(table, table["kind"] == "trial"),
            "rmse",
            planned=visits.variations,
            conditions=conditions,
        ),
        margin=None if margin is None else float(margin),
        unmeasured=visits.unmeasured,
    )


def _compare(
    trials: Columns, names: tuple[str, str], margin: float | None
) -> TrackingComparison:
    """Test two conditions, or say why not."""
    subjects, why = paired_subjects(trials, names)
    analysis = None
    if not why:
        rows = select(trials, np.isin(trials["condition"], names))
        analysis, why = _analyze(rows, names, margin)
    pairs = [
        set(zip(trials["subject"][own], trials["trajectory"][own], strict=True))
        for own in (trials["condition"] == name for name in names)
    ]
    return TrackingComparison(names, analysis, why, subjects, len(pairs[0] ^ pairs[1]))


def _analyze(
    rows: Columns, names: tuple[str, str], margin: float | None
) -> tuple[TrackingAnalysis | None, str]:
    """Run all tests, without the effect of trial number where it is not identifiable.

    With one repeat in the same order for all subjects, trial number and trajectory are
    confounded, and learning cannot be estimated.
    """
    why = ""
    for trial in ("trial", None):
        try:
            return analyze_tracking(
                {**rows, "RMSE": rows["rmse"]},  # the name in sentences
                margin=margin,
                value="RMSE",
                unit=UNITS["rmse"],
                trial=trial,
                conditions=names,
                unequal="keep",
            ), ""
        except IknsError as error:
            why = f"Not tested: {error}"
    return None, why
