"""Experiment 2 from its visits: success, times, statistics."""

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
from ikns.experiments.study.summary.accumulate import Gathered
from ikns.experiments.study.summary.cells import Columns, ordered
from ikns.experiments.study.summary.tracking import not_tested
from ikns.experiments.study.summary.variations import Varied, variations
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

__all__ = ["ObjectCell", "PickComparison", "PickingSummary", "summarize_picking"]


@dataclass(frozen=True)
class ObjectCell:
    """One condition with one object; over all objects: empty text.

    Parameters
    ----------
    condition, object : str
    trials, succeeded, dropped, late, subjects : int
        ``late``: out of time.
    low, high : float
        95 % interval of the share that succeeded (Clopper and Pearson), which counts
        trials as independent.
    mean, deviation, median : float
        Of the times of successful trials, s; NaN without any.
    restricted : float
        Mean time to success within the limit, failures at the limit, s.
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
    """Two conditions compared, or the reason why they could not be.

    Parameters
    ----------
    names : (str, str)
        Every difference is the first minus the second.
    analysis : PickAnalysis or None
    success : SuccessTest or None
        There even where times could not be compared.
    equivalence : Equivalence or None
        Of times, failures at the limit; None without a declared margin.
    why : str
        "Not tested: ..." where there is no analysis.
    subjects : int
        With trials in both conditions.
    """

    names: tuple[str, str]
    analysis: PickAnalysis | None
    success: SuccessTest | None
    equivalence: Equivalence | None
    why: str
    subjects: int


@dataclass(frozen=True, eq=False)
class PickingSummary:
    """What experiment 2 came to, of people or of simulated participants.

    Parameters
    ----------
    limit : float
        When a trial was ended, s; NaN without trials or where trials differ.
    margin : float or None
        Of time, declared in the study file, s.
    cells : list of ObjectCell
        By condition and object; the object of the last of each condition is empty.
    others
        As in :class:`ikns.experiments.study.summary.TrackingSummary`; ``varied`` is the
        share of success, %.
    """

    simulated: bool
    participants: list[str]
    base: str
    conditions: list[str]
    objects: list[str]
    limit: float
    table: dict[str, NDArray[Any]]
    attempts: Counter[tuple[str, str, str]]
    cells: list[ObjectCell]
    comparisons: tuple[PickComparison, ...]
    varied: list[Varied]
    margin: float | None
    said: list[dict[str, Any]]
    redrawn: int
    faults: list[str]
    sessions: dict[tuple[str, str], str] = field(repr=False)
    folders: dict[tuple[str, str], Path] = field(repr=False)

    def trials(self, kind: str = "trial") -> dict[str, NDArray[Any]]:
        """Rows of the base variation and of one kind."""
        keep = (self.table["kind"] == kind) & (self.table["variation"] == self.base)
        return {name: values[keep] for name, values in self.table.items()}


def summarize_picking(gathered: Gathered, plan: Mapping[str, Any]) -> PickingSummary:
    """Tables and statistics of visits that were gathered.

    Parameters
    ----------
    gathered : Gathered
        Of experiment picking.
    plan : mapping
        Table ``picking`` of the study file; empty without one.
    """
    table = gathered.table()
    table["success"] = table["success"].astype(bool)
    base, margin = gathered.base, plan.get("margin_s")
    keep = (table["kind"] == "trial") & (table["variation"] == base)
    tested = {name: values[keep] for name, values in table.items()}
    planned = [str(name) for name in plan.get("conditions", ())]
    found = table["condition"].tolist() + [c for c, _, _ in gathered.attempts]
    conditions = ordered([*planned, *found], ["ikns", *planned])
    listed = plan.get("objects", ())
    known = [str(name) for name in listed] if isinstance(listed, list | tuple) else []
    objects = ordered(sorted(set(tested["object"].tolist())), known)
    limits = set(tested["limit"].tolist())
    limit = float(limits.pop()) if len(limits) == 1 else math.nan
    percent = {**table, "percent": 100.0 * table["success"]}
    every = table["kind"] == "trial"
    return PickingSummary(
        simulated=gathered.simulated,
        participants=gathered.participants(base),
        base=base,
        conditions=conditions,
        objects=objects,
        limit=limit,
        table=table,
        attempts=gathered.attempts,
        cells=[
            _cell(tested, condition, name)
            for condition in conditions
            for name in (*objects, "")
        ],
        comparisons=tuple(
            _compared(tested, (conditions[0], other), limit, margin)
            for other in conditions[1:]
        ),
        varied=variations(
            {name: values[every] for name, values in percent.items()},
            "percent",
            planned=gathered.planned,
            conditions=conditions,
        ),
        margin=None if margin is None else float(margin),
        said=gathered.abouts,
        redrawn=gathered.redrawn,
        faults=gathered.faults,
        sessions=gathered.sessions,
        folders=gathered.folders,
    )


def _cell(table: Columns, condition: str, name: str) -> ObjectCell:
    rows = table["condition"] == condition
    if name:
        rows &= table["object"] == name
    good, outcome = table["success"][rows], table["outcome"][rows]
    time = np.asarray(table["time"][rows], dtype=np.float64)
    limits = np.asarray(table["limit"][rows], dtype=np.float64)
    n, won = len(good), int(good.sum())
    low, high = math.nan, math.nan
    if n:
        share = stats.binomtest(won, n).proportion_ci(method="exact")
        low, high = float(share.low), float(share.high)
    times = time[good]
    return ObjectCell(
        condition,
        name,
        n,
        won,
        int(np.sum(outcome == "dropped")),
        int(np.sum(outcome == "timeout")),
        len(np.unique(table["subject"][rows])),
        low,
        high,
        float(times.mean()) if won else math.nan,
        float(times.std(ddof=1)) if won > 1 else math.nan,
        float(np.median(times)) if won else math.nan,
        restricted_mean(np.where(good, time, limits), good, float(limits[0]))
        if n and np.ptp(limits) == 0
        else math.nan,
    )


def _compared(
    trials: Columns, names: tuple[str, str], limit: float, margin: float | None
) -> PickComparison:
    """All tests of two conditions, or why there are none."""
    both = [set(trials["subject"][trials["condition"] == c].tolist()) for c in names]
    subjects = len(both[0] & both[1])
    why = not_tested(names, [len(side) for side in both], subjects)
    if not why and math.isnan(limit):
        why = "Not tested: trials differ in their time limit."
    if why:
        return PickComparison(names, None, None, None, why, subjects)
    kept = np.isin(trials["condition"], names)
    rows = {name: values[kept] for name, values in trials.items()}
    if np.any(rows["repeat"] != rows["repeat"][0]):  # a pair is an object, once
        once = zip(rows["object"], rows["repeat"], strict=True)
        again = [f"{name} {repeat + 1}" for name, repeat in once]
        rows = {**rows, "object": np.asarray(again)}
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
