"""Experiment 1 from its visits: tables, error over time, statistics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.errors import IknsError
from ikns.experiments.study.summary.accumulate import Gathered
from ikns.experiments.study.summary.cells import Cell, Columns, cells, ordered
from ikns.experiments.study.summary.running_error import ErrorOverTime
from ikns.experiments.study.summary.variations import Varied, variations
from ikns.experiments.tracking import TrackingRecord
from ikns.experiments.visits import read_visit, tracking_record
from ikns.statistics import TrackingAnalysis, analyze_tracking

__all__ = ["UNITS", "Comparison", "TrackingSummary", "summarize_tracking"]

#: Of the metrics that tables tell.
UNITS = {
    "rmse": "of 100",
    "mae": "of 100",
    "lag": "s",
    "overshoot": "of 100",
    "smoothness": "no unit",
    "unseen": "%",
}


@dataclass(frozen=True)
class Comparison:
    """Two conditions compared, or the reason why they could not be.

    Parameters
    ----------
    names : (str, str)
        Every difference is the first minus the second.
    analysis : TrackingAnalysis or None
    why : str
        "Not tested: ..." where there is no analysis.
    subjects : int
        With trials in both conditions.
    alone : int
        Trajectories of a participant that were done in one condition only, and are in
        no paired test.
    """

    names: tuple[str, str]
    analysis: TrackingAnalysis | None
    why: str
    subjects: int
    alone: int


@dataclass(frozen=True, eq=False)
class TrackingSummary:
    """What experiment 1 came to, of people or of simulated participants.

    Parameters
    ----------
    simulated : bool
    participants : list of str
        Of the variation ``base``, with or without a trial.
    base : str
        The variation that everything but ``varied`` is about.
    conditions, trajectories : list of str
    table : dict of str to array
        Trials and training of all variations; a row is a trial that was measured.
    attempts : Counter
        By (condition, kind, outcome), all variations.
    rmse : list of Cell
        By condition and trajectory; the level of the last of each condition is empty.
    metrics : dict of str to list of Cell
        The others of ``UNITS``, likewise.
    errors : dict of (condition, trajectory) to ErrorOverTime
    comparisons : tuple of Comparison
        The first condition against each other one.
    varied : list of Varied
        Empty with one variation.
    margin : float or None
        Declared in the study file, of 100.
    said : list of dict
        Designs, versions and inputs of the visits.
    unmeasured : list of str
        Trials without a second of control signal.
    redrawn : int
        Simulated persons replaced because they could not do the protocol.
    faults : list of str
        Why simulated persons could not take part.
    sessions : dict
        Recorded with the visits, relative to them, by (variation, participant).
    folders : dict
        Of the visits, likewise.
    """

    simulated: bool
    participants: list[str]
    base: str
    conditions: list[str]
    trajectories: list[str]
    table: dict[str, NDArray[Any]]
    attempts: Counter[tuple[str, str, str]]
    rmse: list[Cell]
    metrics: dict[str, list[Cell]]
    errors: dict[tuple[str, str], ErrorOverTime]
    comparisons: tuple[Comparison, ...]
    varied: list[Varied]
    margin: float | None
    said: list[dict[str, Any]]
    unmeasured: list[str]
    redrawn: int
    faults: list[str]
    sessions: dict[tuple[str, str], str] = field(repr=False)
    folders: dict[tuple[str, str], Path] = field(repr=False)

    def trials(self, kind: str = "trial") -> dict[str, NDArray[Any]]:
        """Rows of the base variation and of one kind."""
        return _rows(
            self.table,
            (self.table["kind"] == kind) & (self.table["variation"] == self.base),
        )

    def median_trial(
        self, condition: str, trajectory: str
    ) -> tuple[TrackingRecord, str, float] | None:
        """Trial whose RMSE is nearest the median of its cell, read from disk again.

        Returns
        -------
        (record, participant, rmse), or None where there is none.
        """
        trials = self.trials()
        rows = np.flatnonzero(
            (trials["condition"] == condition) & (trials["trajectory"] == trajectory)
        )
        if not len(rows):
            return None
        rmse = trials["rmse"][rows]
        # The lower of two middle ones, so that it is a trial that was made.
        row = rows[np.argsort(rmse, kind="stable")[(len(rows) - 1) // 2]]
        who = str(trials["subject"][row])
        visit = read_visit(self.folders[self.base, who])
        attempt = visit.attempts[int(trials["number"][row]) - 1]
        return tracking_record(attempt), who, float(trials["rmse"][row])


def summarize_tracking(gathered: Gathered, plan: Mapping[str, Any]) -> TrackingSummary:
    """Tables and statistics of visits that were gathered.

    Parameters
    ----------
    gathered : Gathered
        Of experiment tracking.
    plan : mapping
        Table ``tracking`` of the study file; empty without one.
    """
    table = gathered.table()
    base = gathered.base
    tested = _rows(table, (table["kind"] == "trial") & (table["variation"] == base))
    planned = [str(name) for name in plan.get("conditions", ())]
    found = table["condition"].tolist() + [c for c, _, _ in gathered.attempts]
    conditions = ordered([*planned, *found], ["ikns", *planned])
    trajectories = sorted(set(table["trajectory"].tolist()))
    margin = plan.get("margin")
    order = {"conditions": conditions, "levels": trajectories}
    summary_table = {**tested, "unseen": 100 * tested["unseen"].astype(float)}
    return TrackingSummary(
        simulated=gathered.simulated,
        participants=gathered.participants(base),
        base=base,
        conditions=conditions,
        trajectories=trajectories,
        table=table,
        attempts=gathered.attempts,
        rmse=cells(tested, "rmse", level="trajectory", **order),
        metrics={
            name: cells(summary_table, name, level="trajectory", **order)
            for name in UNITS
            if name != "rmse"
        },
        errors=gathered.error_over_time(),
        comparisons=tuple(
            compared(tested, (conditions[0], other), margin) for other in conditions[1:]
        ),
        varied=variations(
            _rows(table, table["kind"] == "trial"),
            "rmse",
            planned=gathered.planned,
            conditions=conditions,
        ),
        margin=None if margin is None else float(margin),
        said=gathered.abouts,
        unmeasured=gathered.unmeasured,
        redrawn=gathered.redrawn,
        faults=gathered.faults,
        sessions=gathered.sessions,
        folders=gathered.folders,
    )


def compared(
    trials: Columns, names: tuple[str, str], margin: float | None
) -> Comparison:
    """All tests of two conditions, or why there are none."""
    both = [set(trials["subject"][trials["condition"] == c].tolist()) for c in names]
    subjects = len(both[0] & both[1])
    why = not_tested(names, [len(side) for side in both], subjects)
    analysis = None
    if not why:
        rows = _rows(trials, np.isin(trials["condition"], names))
        analysis, why = _analyzed(rows, names, margin)
    places = [
        set(zip(trials["subject"][own], trials["trajectory"][own], strict=True))
        for own in (trials["condition"] == name for name in names)
    ]
    return Comparison(names, analysis, why, subjects, len(places[0] ^ places[1]))


def _analyzed(
    rows: Columns, names: tuple[str, str], margin: float | None
) -> tuple[TrackingAnalysis | None, str]:
    """All tests; without the trial's number where trajectories cannot be told from it.

    So it is with one repeat in the same order for everybody, and learning then cannot
    be told either.
    """
    why = ""
    for trial in ("trial", None):
        try:
            return analyze_tracking(
                {**rows, "RMSE": rows["rmse"]},  # as sentences call it
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


def not_tested(names: tuple[str, str], people: list[int], both: int) -> str:
    """Why two conditions cannot be compared; nothing if they can."""
    if not any(people):
        return "Not tested: no trial was finished."
    for name, count in zip(names, people, strict=True):
        if not count:
            return f"Not tested: no trial of condition {name} was finished."
    if both == 1:
        return "Not tested: one participant only."
    if not both:
        return f"Not tested: no participant did both {names[0]} and {names[1]}."
    return ""


def _rows(table: Columns, rows: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    return {name: values[rows] for name, values in table.items()}
