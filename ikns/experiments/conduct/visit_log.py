"""A visit's folder while the visit goes on: each attempt on disk the moment it ends."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ikns.errors import FileError, IknsError, InvalidInput
from ikns.experiments.visits import append_attempt, create_visit, read_visit
from ikns.experiments.visits.parquet import table_bytes

__all__ = ["VisitBook"]

#: What may not change when a visit goes on.
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
_LOG = "log.jsonl"


class VisitBook:
    """A visit on disk that grows.

    An attempt that cannot be written waits in memory and is tried again.

    Parameters
    ----------
    folder : str or Path
        New, empty, or a visit that was broken off.
    about : mapping
        See :func:`ikns.experiments.visits.create_visit`.

    Attributes
    ----------
    attempts : list of dict
        All rows, those of before included.
    simulated : bool
    fault : str
        Why the last attempt could not be written; empty when all are on disk.

    Raises
    ------
    InvalidInput
        When the folder holds something else, another participant or another design.
    FileError
        When what is there cannot be read.
    """

    def __init__(self, folder: str | Path, about: Mapping[str, Any]) -> None:
        self.folder = Path(folder)
        # Whoever lacks the library hears of it now, not after the first trial.
        table_bytes(about["experiment"], [])
        self.simulated = bool(about["simulated"])
        self.attempts: list[dict[str, Any]] = []
        self.fault = ""
        self._waiting: list[Mapping[str, Any]] = []
        if (self.folder / "visit.json").exists():
            record = read_visit(self.folder, experiment=about["experiment"])
            _check_same(self.folder, record.about, about)
            self.attempts = list(record.attempts)
        else:
            create_visit(self.folder, about)

    def put(self, row: Mapping[str, Any]) -> None:
        """Write an attempt."""
        self.attempts.append(dict(row))
        self._waiting.append(row)
        self.write()

    def write(self) -> None:
        """Try again to write what waits."""
        while self._waiting:
            try:
                append_attempt(self.folder, self._waiting[0])
            except (IknsError, OSError) as error:
                self.fault = str(error)
                return
            del self._waiting[0]
        self.fault = ""

    def note(self, what: str, text: str, *, time: float) -> None:
        """Append a line to the visit's log, which is for people.

        Parameters
        ----------
        what, text : str
        time : float
            Since this part of the visit began, s.
        """
        line = json.dumps({"time": round(time, 3), "what": what, "text": text})
        try:
            with (self.folder / _LOG).open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            self.fault = f"{self.folder / _LOG}: cannot be written: {error.strerror}."

    def close(self) -> None:
        """Make sure that everything is on disk.

        Raises
        ------
        FileError
            When something is not.
        """
        self.write()
        if self._waiting:
            raise FileError(
                f"{self.folder}: {len(self._waiting)} attempts could not be written: "
                f"{self.fault}"
            )


def _check_same(
    folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Refuse to go on with a visit as another one."""
    told = json.loads(json.dumps(dict(now)))
    for key in _FIXED:
        old, new = before.get(key), told.get(key)
        if key == "design" and isinstance(old, dict) and isinstance(new, dict):
            odd = next((k for k in {**old, **new} if old.get(k) != new.get(k)), None)
            if odd is None:
                continue
            key, old, new = odd, old.get(odd), new.get(odd)
        if old != new:
            raise InvalidInput(
                f"{folder}: expected {key} {_said(old)}, with which this visit was "
                f"begun, found {_said(new)}; take another folder for another visit."
            )


def _said(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else json.dumps(value)
