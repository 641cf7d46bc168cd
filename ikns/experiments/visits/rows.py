"""What an attempt is as a row of a table, and which attempts count."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ikns.errors import InvalidInput
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.schedule import Step
from ikns.experiments.tracking.trial import TrackingRecord
from ikns.experiments.tracking.visit import Attempt

__all__ = [
    "COLUMNS",
    "EXPERIMENTS",
    "FINAL",
    "counting",
    "tracking_record",
    "tracking_row",
]

#: Columns that every attempt of an experiment has, and what they hold. ``series`` is a
#: list of doubles of any length; a table may have more columns of single values.
COLUMNS: dict[str, dict[str, str]] = {
    "tracking": {
        "number": "int",
        "key": "text",
        "kind": "text",
        "condition": "text",
        "trajectory": "text",
        "repeat": "int",
        "profile_seed": "int",
        "seconds": "float",
        "align": "float",
        "outcome": "text",
        "reason": "text",
        "practised": "int",
        "time": "series",
        "c": "series",
    },
    "picking": {
        "number": "int",
        "key": "text",
        "kind": "text",
        "condition": "text",
        "object": "text",
        "repeat": "int",
        "outcome": "text",
        "reason": "text",
        "practised": "int",
        "time": "float",
        "limit": "float",
        "comment": "text",
    },
}
EXPERIMENTS = tuple(COLUMNS)
#: Outcomes after which a step is not due any more.
FINAL = {
    "tracking": ("done", "skipped"),
    "picking": ("success", "dropped", "timeout", "skipped"),
}
_ENDED = {outcome for outcomes in FINAL.values() for outcome in outcomes}


def tracking_row(
    number: int, step: Step, attempt: Attempt, *, align: float, practised: int
) -> dict[str, Any]:
    """Put an attempt at a tracking step into a row.

    Parameters
    ----------
    number : int
        In the order of the visit, from 1.
    step : Step
    attempt : Attempt
        At this step.
    align : float
        Time before the profile, s.
    practised : int
        Trials done before in this condition.
    """
    if attempt.key != step.key:
        raise InvalidInput(
            f"expected an attempt at {step.key or 'a trial'}, found one at "
            f"{attempt.key or 'a rest'}."
        )
    record = attempt.record
    return {
        "number": number,
        "key": step.key,
        "kind": step.kind,
        "condition": step.condition,
        "trajectory": step.profile,
        "repeat": step.repeat,
        "profile_seed": step.seed,
        "seconds": step.seconds,
        "align": align,
        "outcome": attempt.outcome,
        "reason": attempt.reason,
        "practised": practised,
        "time": np.empty(0) if record is None else record.time,
        "c": np.empty(0) if record is None else record.c,
    }


def tracking_record(row: Mapping[str, Any]) -> TrackingRecord:
    """Return what a row recorded; its profile is drawn again from its seed."""
    profile = draw_profile(
        row["trajectory"], row["profile_seed"], seconds=row["seconds"]
    )
    return TrackingRecord(
        profile=profile,
        time=row["time"],
        target=profile.at(row["time"]),
        c=row["c"],
        state="done" if row["outcome"] == "done" else "aborted",
        reason=row["reason"],
    )


def counting(attempts: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the attempts that count: of each step the last, if it was final.

    Final is what need not come again: done, or in picking success, dropped and timeout,
    and in both skipped, which holds no data. An aborted attempt counts for nothing, and
    so does one that was followed by "again". Training is among them.

    Examples
    --------
    >>> went = [("a", "done"), ("b", "aborted"), ("b", "done"), ("a", "again")]
    >>> counting({"key": key, "outcome": outcome} for key, outcome in went)
    [{'key': 'b', 'outcome': 'done'}]
    """
    rows = [dict(row) for row in attempts]
    last = {row["key"]: k for k, row in enumerate(rows)}
    return [
        row
        for k, row in enumerate(rows)
        if last[row["key"]] == k and row["outcome"] in _ENDED
    ]
