"""All numbers of a report, as plain tables for JSON and CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections import Counter
from typing import Any

from ikns.experiments.study.summary.answers import picking_answer, tracking_answer
from ikns.experiments.study.summary.methods import methods
from ikns.experiments.study.summary.picking import PickingSummary
from ikns.experiments.study.summary.study import Group, StudySummary
from ikns.experiments.study.summary.tracking import TrackingSummary


def numbers(summary: StudySummary) -> dict[str, Any]:
    """Return all numbers of a study: dicts, lists, text and floats, NaN for missing."""
    return {
        "study": summary.name,
        "simulated": [group.simulated for group in summary.groups],
        "visits": summary.visits,
        "left_out": [
            {"folder": str(each.folder), "reason": each.reason}
            for each in summary.left_out
        ],
        "groups": [_group(group) for group in summary.groups],
    }


def trials_csv(summary: StudySummary, experiment: str) -> str:
    """Return all trials of an experiment as CSV, people first; empty without any.

    Parameters
    ----------
    summary : StudySummary
    experiment : {"tracking", "picking"}
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    header: list[str] = []
    for group in summary.groups:
        found = group.tracking if experiment == "tracking" else group.picking
        if found is None:
            continue
        if not header:
            header = ["simulated", *found.table]
            writer.writerow(header)
        simulated = "yes" if group.simulated else "no"
        for row in zip(*(v.tolist() for v in found.table.values()), strict=True):
            writer.writerow(
                [simulated, *("" if cell != cell else cell for cell in row)]
            )
    return text.getvalue()


def error_csv(summary: StudySummary) -> str:
    """Return the error over time of tracking as CSV, people first; empty without any.

    For each condition, trajectory and time (s): number of participants, mean, standard
    deviation and percentiles of pointer minus target, of 100.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("time", "count", "mean", "deviation", "low", "middle", "high")
    header: tuple[str, ...] = ("simulated", "condition", "trajectory", "time_s", "n")
    header += (*names[2:4], "p10", "p50", "p90")
    for group in summary.groups:
        for (condition, trajectory), error in (
            {} if group.tracking is None else group.tracking.errors
        ).items():
            if header:
                writer.writerow(header)
                header = ()
            columns = [getattr(error, name).tolist() for name in names]
            simulated = "yes" if group.simulated else "no"
            for row in zip(*columns, strict=True):
                values = ["" if value != value else value for value in row]
                writer.writerow([simulated, condition, trajectory, *values])
    return text.getvalue()


def _group(group: Group) -> dict[str, Any]:
    questions = [
        *tracking_answer(group.tracking, simulated=group.simulated),
        *picking_answer(group.picking, simulated=group.simulated),
    ]
    return {
        "simulated": group.simulated,
        "answers": [{"question": q, "answer": a} for q, a in questions],
        "tracking": None if group.tracking is None else _tracking(group.tracking),
        "picking": None if group.picking is None else _picking(group.picking),
        "methods": methods(group),
    }


def _tracking(found: TrackingSummary) -> dict[str, Any]:
    return {
        "participants": found.participants,
        "conditions": found.conditions,
        "trajectories": found.trajectories,
        "margin": found.margin,
        "attempts": _attempts(found.attempts),
        "unmeasured": found.unmeasured,
        "rmse": [dataclasses.asdict(cell) for cell in found.rmse],
        "metrics": {
            name: [dataclasses.asdict(cell) for cell in each]
            for name, each in found.metrics.items()
        },
        "comparisons": [dataclasses.asdict(each) for each in found.comparisons],
        "variations": [dataclasses.asdict(each) for each in found.varied],
    }


def _picking(found: PickingSummary) -> dict[str, Any]:
    return {
        "participants": found.participants,
        "conditions": found.conditions,
        "objects": found.objects,
        "limit": found.limit,
        "margin": found.margin,
        "attempts": _attempts(found.attempts),
        "objects_by_condition": [dataclasses.asdict(cell) for cell in found.cells],
        "comparisons": [dataclasses.asdict(each) for each in found.comparisons],
        "variations": [dataclasses.asdict(each) for each in found.varied],
    }


def _attempts(counts: Counter[tuple[str, str, str]]) -> list[dict[str, Any]]:
    return [
        {"condition": c, "kind": k, "outcome": o, "count": n}
        for (c, k, o), n in sorted(counts.items())
    ]
