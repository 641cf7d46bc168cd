"""Summary of pick and place: success, times, statistics."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ikns.errors import IknsError
from ikns.experiments.study.summary.accumulate import VisitAccumulator
from ikns.experiments.study.summary.trials import (
    Columns,
    ordered,
    paired_subjects,
    rows_of,
    select,
    study_conditions,
)
from ikns.experiments.study.summary.variations import VariationMean, compare_variations
from ikns.statistics import (
    Equivalence,
    PickAnalysis,
    SuccessTest,
    analyze_picking,
    equivalence,
    restricted_mean,
    success_pairs,
    success_test,
)
from ikns.statistics.times import restricted_pairs


@dataclass(frozen=True)
class ObjectResult:
    """Results in one condition with one object; with all objects: empty text.

    Parameters
    ----------
    condition, object : str
    trials, succeeded, dropped, late, subjects : int
        Counts; ``late`` is the timeouts.
    low, high : float
        95 % interval of the success rate (Clopper and Pearson), which takes trials as
        independent.
    mean, deviation, median : float
        Times of successful trials, s; NaN without any.
    restricted : float
        Restricted mean time to success, failures counted at the limit, s.
    """

    condition: str
    object: str
    trials: int
    succeeded: int
    dropped: int
    late: int
    subjects: int
    low: float
    high: float
    mean: float
    deviation: float
    median: float
    restricted: float


@dataclass(frozen=True)
class PickComparison:
    """Comparison of two conditions, or the reason why there is none.

    Parameters
    ----------
    names : (str, str)
        Every difference is the first minus the second.
    analysis : PickAnalysis or None
    success : SuccessTest or None
        Also where times could not be compared.
    equivalence : Equivalence or None
        Of times, failures counted at the limit; None without a declared margin.
    why : str
        "Not tested: ..." where there is no analysis.
    subjects : int
        Number of subjects with trials in both conditions.
    """

    names: tuple[str, str]
    analysis: PickAnalysis | None
    success: SuccessTest | None
    equivalence: Equivalence | None
    why: str
    subjects: int


@dataclass(frozen=True, eq=False)
class PickingSummary:
    """Results of experiment 2, of people or of simulated participants.

    Parameters
    ----------
    limit : float
        Time limit of a trial, s; NaN without trials or where trials differ.
    margin : float or None
        Margin of equivalence for time in the study file, s.
    cells : list of ObjectResult
        By condition and object; the last of each condition is of all objects.
    others
        As in :class:`ikns.experiments.study.summary.TrackingSummary`; ``varied`` is the
        success rate, %.
    """

    simulated: bool
    participants: list[str]
    base: str
    conditions: list[str]
    objects: list[str]
    limit: float
    table: dict[str, NDArray[Any]]
    attempts: Counter[tuple[str, str, str]]
    cells: list[ObjectResult]
    comparisons: tuple[PickComparison, ...]
    varied: list[VariationMean]
    margin: float | None
    settings: list[dict[str, Any]]
    redrawn: int
    faults: list[str]
    sessions: dict[tuple[str, str], str] = field(repr=False)
    folders: dict[tuple[str, str], Path] = field(repr=False)

    def trials(self, kind: str = "trial") -> dict[str, NDArray[Any]]:
        """Return the rows of the base variation and of one kind."""
        return rows_of(self.table, kind=kind, variation=self.base)


def summarize_picking(
    visits: VisitAccumulator, plan: Mapping[str, Any]
) -> PickingSummary:
    """Compute tables and statistics.

    Parameters
    ----------
    visits : VisitAccumulator
        Of experiment picking.
    plan : mapping
        Table ``picking`` of the study file; empty without one.
    """
    table, margin = visits.table(), plan.get("margin_s")
    table["success"] = table["success"].astype(bool)
    tested = rows_of(table, kind="trial", variation=visits.base)
    conditions = study_conditions(table, [c for c, _, _ in visits.attempts], plan)
    planned = plan.get("objects", ())
    first = [str(name) for name in planned] if isinstance(planned, list | tuple) else []
    objects = ordered(sorted(set(tested["object"].tolist())), first)
    limits = set(tested["limit"].tolist())
    limit = float(limits.pop()) if len(limits) == 1 else math.nan
    return PickingSummary(
        **visits.summary_fields(),
        conditions=conditions,
        objects=objects,
        limit=limit,
        table=table,
        cells=[
            _object_result(tested, condition, name)
            for condition in conditions
            for name in (*objects, "")
        ],
        comparisons=tuple(
            _compare(tested, (conditions[0], other), limit, margin)
            for other in conditions[1:]
        ),
        varied=compare_variations(
            select(
                {**table, "percent": 100.0 * table["success"]}, table["kind"] == "trial"
            ),
            "percent",
            planned=visits.variations,
            conditions=conditions,
        ),
        margin=None if margin is None else float(margin),
    )


def _object_result(table: Columns, condition: str, name: str) -> ObjectResult:
    rows = table["condition"] == condition
    if name:
        rows &= table["object"] == name
    good, outcome = table["success"][rows], table["outcome"][rows]
    time = np.asarray(table["time"][rows], dtype=np.float64)
    limits = np.asarray(table["limit"][rows], dtype=np.float64)
    n, successes = len(good), int(good.sum())
    low, high = math.nan, math.nan
    if n:
        share = stats.binomtest(successes, n).proportion_ci(method="exact")
        low, high = float(share.low), float(share.high)
    times = time[good]
    return ObjectResult(
        condition,
        name,
        n,
        successes,
        int(np.sum(outcome == "dropped")),
        int(np.sum(outcome == "timeout")),
        len(np.unique(table["subject"][rows])),
        low,
        high,
        float(times.mean()) if successes else math.nan,
        float(times.std(ddof=1)) if successes > 1 else math.nan,
        float(np.median(times)) if successes else math.nan,
        restricted_mean(np.where(good, time, limits), good, float(limits[0]))
        if n and np.ptp(limits) == 0
        else math.nan,
    )


def _compare(
    trials: Columns, names: tuple[str, str], limit: float, margin: float | None
) -> PickComparison:
    """Test two conditions, or say why not."""
    subjects, why = paired_subjects(trials, names)
    if not why and math.isnan(limit):
        why = "Not tested: trials differ in their time limit."
    if why:
        return PickComparison(names, None, None, None, why, subjects)
    rows = select(trials, np.isin(trials["condition"], names))
    if np.any(rows["repeat"] != rows["repeat"][0]):  # a pair is one repeat of an object
        repeats = zip(rows["object"], rows["repeat"], strict=True)
        labels = [f"{name} {repeat + 1}" for name, repeat in repeats]
        rows = {**rows, "object": np.asarray(labels)}
    analysis = success = same = None
    try:
        success = success_test(success_pairs(rows, conditions=names, unequal="keep"))
        analysis = analyze_picking(rows, limit=limit, conditions=names, unequal="keep")
        if margin is not None:
            pairs = restricted_pairs(
                rows, limit=limit, conditions=names, unequal="keep"
            )
            same = equivalence(pairs, margin=margin)
    except IknsError as error:
        why = f"Not tested: {error}"
    return PickComparison(names, analysis, success, same, why, subjects)
