"""Measures the trials of a visit, from its attempts alone.

One visit is in memory at a time; its traces are not kept.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError, IknsError, NotEnoughData, naming
from ikns.experiments.tracking import error_over_time, measure
from ikns.experiments.visits import (
    VisitRecord,
    counted_attempts,
    has_attempts,
    read_visit,
    tracking_record,
)

#: Of :class:`ikns.experiments.tracking.Metrics`.
METRICS = (
    "rmse",
    "mae",
    "lag",
    "correlation",
    "overshoot",
    "smoothness",
    "target_smoothness",
    "unseen",
    "samples",
)
_WHO = ("subject", "variation", "condition", "kind", "repeat", "number", "practised")
#: Columns of the tables of trials.
TRACKING = (*_WHO, "trajectory", "trial", "align", "seconds", *METRICS)
PICKING = (*_WHO, "object", "trial", "success", "outcome", "time", "limit", "comment")
#: Which of them hold text, and which whole numbers.
TEXTS = (*_WHO[:4], "trajectory", "object", "outcome", "comment")
WHOLE = ("repeat", "number", "practised", "trial", "samples")
#: Samples per second of the error over time.
RATE = 20.0


@dataclass(frozen=True)
class ExcludedVisit:
    """A visit that could not be used, and the reason."""

    folder: Path
    reason: str


@dataclass(frozen=True, eq=False)
class Digest:
    """A visit reduced to its measured trials.

    Parameters
    ----------
    folder : Path
    about : dict
        Content of ``visit.json``.
    table : dict of str to list
        Trials that count and could be measured, training included, by column.
    attempts : Counter
        Number of attempts, by (condition, kind, outcome).
    errors : dict of (condition, trajectory, seconds) to (T,) array
        Pointer minus target at ``RATE``, of 100, mean over repeats.
    unmeasured : list of str
        Finished trials with less than a second of control signal.
    """

    folder: Path
    about: dict[str, Any]
    table: dict[str, list[Any]]
    attempts: Counter[tuple[str, str, str]]
    errors: dict[tuple[str, str, float], Array] = field(default_factory=dict)
    unmeasured: list[str] = field(default_factory=list)

    @property
    def experiment(self) -> str:
        """``tracking`` or ``picking``."""
        return str(self.about["experiment"])

    @property
    def variation(self) -> str:
        """Name of the variation; empty for the study as planned."""
        return str(self.about.get("variation") or "")


def digest_visit(folder: Path) -> Digest | ExcludedVisit:
    """Read a visit and measure its trials."""
    try:
        with naming(str(folder)):
            visit = read_visit(folder)
            if not has_attempts(folder):
                raise FileError("there are no attempts in this visit.")
            if visit.about["experiment"] == "tracking":
                return _tracking(visit)
            return _picking(visit)
    except IknsError as error:
        return ExcludedVisit(folder, str(error))


def _tracking(visit: VisitRecord) -> Digest:
    digest = _new_digest(visit, TRACKING)
    traces: dict[tuple[str, str, float], list[Array]] = {}
    for row, trial in _trials(visit, ("done",)):
        _check_trace(row)
        record = tracking_record(row)
        try:
            found = measure(record)
        except NotEnoughData:
            digest.unmeasured.append(str(row["key"]))
            continue
        _append(
            digest.table,
            _identity(digest, row)
            | {name: row[name] for name in ("trajectory", "align", "seconds")}
            | {"trial": trial}
            | {name: getattr(found, name) for name in METRICS},
        )
        if row["kind"] == "trial":
            key = (row["condition"], row["trajectory"], row["seconds"])
            _, (error,) = error_over_time([record], rate=RATE)
            traces.setdefault(key, []).append(error)
    for key, errors in traces.items():
        digest.errors[key] = _mean(np.array(errors))
    return digest


def _picking(visit: VisitRecord) -> Digest:
    digest = _new_digest(visit, PICKING)
    for row, trial in _trials(visit, ("success", "dropped", "timeout")):
        time, limit = row["time"], row["limit"]
        if row["outcome"] == "success" and not 0 <= time < np.inf or not limit > 0:
            raise FileError(
                f"expected a time of success from 0 s and a limit above 0 s, found "
                f"{time:g} and {limit:g} in attempt {row['number']}."
            )
        _append(
            digest.table,
            _identity(digest, row)
            | {name: row[name] for name in ("object", "outcome", "time", "limit")}
            | {"comment": row["comment"], "trial": trial}
            | {"success": row["outcome"] == "success"},
        )
    return digest


def _check_trace(row: dict[str, Any]) -> None:
    """Raise if times do not increase, or there are not as many values of c."""
    time, c = row["time"], row["c"]
    if (
        len(time) != len(c)
        or not np.all(np.diff(time) > 0)
        or not np.isfinite(time).all()
    ):
        raise FileError(
            "expected increasing times and as many values of c, found "
            f"{len(time)} and {len(c)} in attempt {row['number']}."
        )


def _new_digest(visit: VisitRecord, columns: tuple[str, ...]) -> Digest:
    attempts = Counter(
        (str(row["condition"]), str(row["kind"]), str(row["outcome"]))
        for row in visit.attempts
    )
    return Digest(visit.folder, visit.about, {name: [] for name in columns}, attempts)


def _trials(
    visit: VisitRecord, outcomes: tuple[str, ...]
) -> list[tuple[dict[str, Any], int]]:
    """Return the attempts that count, each with its number within its kind."""
    seen: Counter[tuple[str, str]] = Counter()
    found = []
    for row in counted_attempts(visit.attempts):
        if row["outcome"] in outcomes:
            seen[row["condition"], row["kind"]] += 1
            found.append((row, seen[row["condition"], row["kind"]]))
    return found


def _identity(digest: Digest, row: dict[str, Any]) -> dict[str, Any]:
    same = ("condition", "kind", "repeat", "number", "practised")
    return {
        "subject": digest.about["participant"],
        "variation": digest.variation,
    } | {name: row[name] for name in same}


def _append(table: dict[str, list[Any]], row: dict[str, Any]) -> None:
    for name, values in table.items():
        values.append(row[name])


def _mean(errors: Array) -> Array:
    """Return the mean over the first axis, NaN excluded."""
    known = np.isfinite(errors)
    count = known.sum(axis=0)
    total = np.where(known, errors, 0.0).sum(axis=0)
    return np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
