"""The recordings folder: every take as a C3D file, and the decision about it.

A take is on disk before it is judged, so a crash loses only the step being recorded.
Takes are never deleted or overwritten.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from ikns.errors import FileError, InvalidInput, plain
from ikns.live.calibration.protocol import ProtocolStep
from ikns.live.calibration.verdict import Verdict
from ikns.output.file import check_parent
from ikns.output.lock import hold_lock
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording

#: Version of ``protocol.json``.
FORMAT = 1
_NAME = "protocol.json"


class RecordingsFolder:
    """Takes and decisions of one live calibration.

    Parameters
    ----------
    path : Path
    settings : dict
        Text and numbers that must be the same when it is resumed.
    resume : bool
        Continue with an existing folder.

    Raises
    ------
    InvalidInput
        When the folder exists and `resume` is false, or it has other settings.
    FileError
        When there is nothing to resume, or it cannot be read or written.
    """

    def __init__(
        self, path: Path, settings: dict[str, Any], *, resume: bool = False
    ) -> None:
        self.path = path
        self._takes: list[dict[str, Any]] = []
        self._settings = settings
        if resume:
            self._open()
            return
        if path.exists():
            raise InvalidInput(
                f"{path}: already contains recordings; continue with --resume "
                "or choose another folder with --recordings."
            )
        check_parent(path)
        try:
            path.mkdir()
        except OSError as error:
            raise FileError(f"{path}: cannot be created: {plain(error)}.") from None
        self._write()

    def locked(self) -> AbstractContextManager[None]:
        """Keep other programs from recording into it; see :func:`hold_lock`."""
        return hold_lock(self.path / ".lock", "to record takes")

    @property
    def accepted(self) -> dict[str, Path]:
        """Recording of each accepted step: the last one accepted."""
        return {
            take["step"]: self.path / take["recording"]
            for take in self._takes
            if take["outcome"] == "accepted"
        }

    def pending(self, steps: Sequence[ProtocolStep]) -> dict[str, Path]:
        """Return recordings without a decision, by step."""
        decided = {take["recording"] for take in self._takes}
        found: dict[str, Path] = {}
        for step in steps:
            if step.name not in self.accepted:
                new = [p for p in self._files(step) if p.name not in decided]
                found |= {step.name: new[-1]} if new else {}
        return found

    def keep(self, step: ProtocolStep, recording: Recording) -> Recording:
        """Write a take and sync it to the disk.

        Returns
        -------
        Recording
            As read back, with the same numbers that a calibration from files will use.

        Raises
        ------
        FileError, InvalidInput
            When it cannot be written.
        """
        take = len(self._files(step)) + 1
        path = self.path / f"{step.name}{f'_take_{take}' * (take > 1)}.c3d"
        write_c3d(path, recording)
        _sync(path)
        return read(path)

    def decide(self, step: ProtocolStep, outcome: str, verdict: Verdict) -> None:
        """Write the decision about the last take of a step."""
        files = self._files(step)
        decided = {take["recording"] for take in self._takes}
        if not files or files[-1].name in decided:  # nothing was recorded
            return
        self._takes.append(
            {
                "step": step.name,
                "recording": files[-1].name,
                "outcome": outcome,
                "recommended": "keep" if verdict.keep else "redo",
                "reason": verdict.reason,
                "values": _plain(verdict.values),
            }
        )
        self._write()

    @property
    def takes(self) -> list[dict[str, Any]]:
        """Every take with a decision, in the order of decisions."""
        return [dict(take) for take in self._takes]

    def _files(self, step: ProtocolStep) -> list[Path]:
        """Return the files of a step's takes, in order."""
        first = self.path / f"{step.name}.c3d"
        more = sorted(
            self.path.glob(f"{step.name}_take_*.c3d"),
            key=lambda p: int(p.stem.rsplit("_", 1)[-1]),
        )
        return [first, *more] if first.exists() else more

    def _open(self) -> None:
        place = self.path / _NAME
        try:
            table = json.loads(place.read_text(encoding="utf-8"))
            if table["format"] != FORMAT:
                raise ValueError(f"format {table['format']}")
            settings, self._takes = table["settings"], table["takes"]
            self.accepted  # noqa: B018 - raises if the table is damaged
        except FileNotFoundError:
            raise FileError(
                f"{self.path}: there is no live calibration to continue."
            ) from None
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise FileError(
                f"{place}: cannot be read as a live calibration ({error!r})."
            ) from None
        for name, value in self._settings.items():
            if settings.get(name) != value:
                raise InvalidInput(
                    f"{self.path}: was recorded with {name} {settings.get(name)}, "
                    f"found {value}; resume with the same value."
                )
        gone = [path for path in self.accepted.values() if not path.is_file()]
        if gone:
            raise FileError(f"{gone[0]}: the accepted recording is missing.")

    def _write(self) -> None:
        place = self.path / _NAME
        table = {"format": FORMAT, "settings": self._settings, "takes": self._takes}
        part = place.with_suffix(".part")
        try:
            part.write_text(json.dumps(table, indent=1, allow_nan=False) + "\n")
            _sync(part)
            part.replace(place)
            _sync(self.path)
        except OSError as error:
            raise FileError(f"{place}: cannot be written: {plain(error)}.") from None


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _plain(value: Any) -> Any:
    """Convert to types of JSON; a number that is not finite becomes null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value
