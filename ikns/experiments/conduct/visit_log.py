"""The files of a running visit: each attempt is on disk the moment it ends."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ikns.errors import DataLoss, IknsError, InvalidInput, plain
from ikns.experiments.visits import append_attempt, create_visit, read_visit
from ikns.experiments.visits.parquet import table_bytes

#: What must be the same when a visit is continued.
_FIXED = (
    "experiment",
    "study",
    "variation",
    "participant",
    "participant_number",
    "simulated",
    "seed",
    "design",
    "align",
)
_HEADER, _LOG = "visit.json", "log.jsonl"


class VisitLog:
    """Writes attempts and events of a running visit.

    An attempt that cannot be written is kept in memory and tried again.

    Parameters
    ----------
    folder : str or Path
        New, empty, or a visit to continue.
    about : mapping
        See :func:`ikns.experiments.visits.create_visit`.

    Attributes
    ----------
    attempts : list of dict
        All rows, those of earlier runs included.
    simulated : bool
    fault : str
        Why the last attempt could not be written; empty when all are on disk.

    Raises
    ------
    InvalidInput
        When the folder holds something else, another participant or another design.
    FileError
        When the visit cannot be read.
    """

    def __init__(self, folder: str | Path, about: Mapping[str, Any]) -> None:
        self.folder = Path(folder)
        # A missing library is reported now, not after the first trial.
        table_bytes(about["experiment"], [])
        self.simulated = bool(about["simulated"])
        self.attempts: list[dict[str, Any]] = []
        self.fault = ""
        self._unwritten: list[Mapping[str, Any]] = []
        self._new = not (self.folder / _HEADER).exists()
        if not self._new:
            record = read_visit(self.folder, experiment=about["experiment"])
            _check_same(self.folder, record.about, about)
            self.attempts = list(record.attempts)
        else:
            create_visit(self.folder, about)

    def append(self, row: Mapping[str, Any]) -> None:
        """Write an attempt."""
        self.attempts.append(dict(row))
        self._unwritten.append(row)
        self.flush()

    def flush(self) -> None:
        """Write the attempts that could not be written so far."""
        while self._unwritten:
            try:
                append_attempt(self.folder, self._unwritten[0])
            except (IknsError, OSError) as error:
                self.fault = str(error)
                return
            del self._unwritten[0]
        self.fault = ""

    def log_event(self, name: str, text: str, *, time: float) -> None:
        """Append a line to ``log.jsonl``, which is for people.

        Parameters
        ----------
        name, text : str
        time : float
            Since this run of the visit began, s.
        """
        line = json.dumps({"time": round(time, 3), "what": name, "text": text})
        try:
            with (self.folder / _LOG).open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            self.fault = f"{self.folder / _LOG}: cannot be written: {plain(error)}."

    def discard_unused(self) -> None:
        """Remove a visit that this run began and in which no attempt was made.

        So a start that failed does not stand in the way of the next one.
        """
        if self._new and not self.attempts:
            with suppress(OSError):
                (self.folder / _LOG).unlink(missing_ok=True)
                (self.folder / _HEADER).unlink()
                self.folder.rmdir()  # unless something else is in it

    def close(self) -> None:
        """Write everything that is not on disk yet.

        Raises
        ------
        DataLoss
            When something cannot be written.
        """
        self.flush()
        if self._unwritten:
            lost = len(self._unwritten)
            raise DataLoss(
                f"{self.folder}: {lost} attempt{'s' * (lost != 1)} could not be "
                f"written: {self.fault}"
            )


def _check_same(
    folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Refuse to continue a visit with another participant or design."""
    about = json.loads(json.dumps(dict(now)))
    for key in _FIXED:
        old, new = before.get(key), about.get(key)
        if key == "design" and isinstance(old, dict) and isinstance(new, dict):
            changed = (k for k in {**old, **new} if old.get(k) != new.get(k))
            first = next(changed, None)
            if first is None:
                continue
            key, old, new = first, old.get(first), new.get(first)
        if old != new:
            raise InvalidInput(
                f"{folder}: expected {key} {_value_text(old)} as when this visit was "
                f"begun, found {_value_text(new)}; use another folder for another "
                "visit."
            )


def _value_text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else json.dumps(value)
