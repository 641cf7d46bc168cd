"""An attempt as a row of a table, and which attempts count."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ikns.errors import InvalidInput
from ikns.experiments.picking.visit import FINAL as PICKING_FINAL
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.schedule import TrackingStep
from ikns.experiments.tracking.trial import TrackingRecord
from ikns.experiments.tracking.visit import FINAL as TRACKING_FINAL
from ikns.experiments.tracking.visit import Attempt

#: Columns that every attempt of an experiment has, and their types. ``series`` is a
#: list of doubles of any length; a table may have further columns of single values.
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
_FINAL = {*TRACKING_FINAL, *PICKING_FINAL}


def tracking_row(
    number: int, step: TrackingStep, attempt: Attempt, *, align: float, practised: int
) -> dict[str, Any]:
    """Return an attempt at a tracking step as a row.

    Parameters
    ----------
    number : int
        In the order of the visit, from 1.
    step : TrackingStep
    attempt : Attempt
        An attempt at this step.
    align : float
        Time before the profile, s.
    practised : int
        Earlier trials in this condition.
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
    """Return the record of a row; its profile is drawn again from its seed."""
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


def counted_attempts(attempts: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the attempts that count: the last one at each step, if it was final.

    Final outcomes are done, or in picking success, dropped and timeout, and in both
    skipped, which has no data. An aborted attempt does not count, nor does one that was
    followed by "again". Attempts in training are included.

    Examples
    --------
    >>> went = [("a", "done"), ("b", "aborted"), ("b", "done"), ("a", "again")]
    >>> counted_attempts({"key": key, "outcome": outcome} for key, outcome in went)
    [{'key': 'b', 'outcome': 'done'}]
    """
    rows = [dict(row) for row in attempts]
    last = {row["key"]: k for k, row in enumerate(rows)}
    return [
        row
        for k, row in enumerate(rows)
        if last[row["key"]] == k and row["outcome"] in _FINAL
    ]
