"""Append rows to files without waiting for the disk.

Rows go into a queue; a thread formats them, writes them five times per second and syncs
the files once per second. A killed process loses what is in the queue; a machine that
loses power, about a second. Rows are written completely or not at all: after a fault
(such as a full disk) the file is cut back to its last complete row, rows wait in
memory, and the thread tries again. Deleted files are reported too.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.live.session.channels import Channel

__all__ = ["RunWriter"]

Row = tuple[float | str, ...]

#: Time between writes, and between syncs to the disk, s.
_FLUSH, _SYNC = 0.2, 0.8
#: Rows per file that wait in memory while it cannot be written: ten minutes at 100 Hz.
_WAITING = 60_000


class RunWriter:
    """Files of one run, to which rows are appended.

    Parameters
    ----------
    files : mapping of name to (path, channels)
        Each file must exist, empty or with a header.
    on_fault : callable, optional
        Called from the writing thread with a message when a file cannot be written, and
        again when it can be.

    Attributes
    ----------
    fault : str
        Present fault; empty if there is none.
    lost : int
        Number of rows lost.
    """

    def __init__(
        self,
        files: dict[str, tuple[Path, Sequence[Channel]]],
        *,
        on_fault: Callable[[str], None] | None = None,
    ) -> None:
        self.fault = ""
        self._on_fault = on_fault
        self._files = {
            name: _File(path, channels) for name, (path, channels) in files.items()
        }
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Number of rows lost."""
        return sum(file.lost for file in self._files.values())

    def row(self, name: str, values: Sequence[float | str]) -> None:
        """Append a row to a file, without waiting.

        Parameters
        ----------
        name : str
            Name of the file.
        values : sequence
            One per channel; NaN for a missing value.
        """
        file = self._files[name]
        if len(values) != file.width:
            raise InvalidInput(
                f"expected {file.width} values for '{name}', found {len(values)}."
            )
        # NumPy's numbers would print with their type.
        file.put(tuple(v if isinstance(v, str) else float(v) for v in values))

    def close(self) -> None:
        """Write and sync all rows; harmless when repeated."""
        self._closing.set()
        self._thread.join()
        for file in self._files.values():
            file.close()

    def __enter__(self) -> RunWriter:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def _run(self) -> None:
        synced = time.monotonic()
        while True:
            last = self._closing.wait(_FLUSH)
            sync = last or time.monotonic() - synced >= _SYNC
            faults = [file.write(sync=sync) for file in self._files.values()]
            if sync:
                synced = time.monotonic()
            self._report("; ".join(fault for fault in faults if fault))
            if last:
                return

    def _report(self, fault: str) -> None:
        if fault != self.fault:
            self.fault = fault
            if self._on_fault:
                self._on_fault(fault or "the session is written again.")


class _File:
    """One file and the rows waiting for it."""

    def __init__(self, path: Path, channels: Sequence[Channel]) -> None:
        self.path, self.width, self.lost = path, len(channels), 0
        self._forms = [channel.form for channel in channels]
        self._line = "\t".join(self._forms) + "\n"
        self._rows: deque[Row] = deque()
        self._descriptor = os.open(path, os.O_WRONLY | os.O_APPEND)
        self._size = os.fstat(self._descriptor).st_size
        self._torn = self._deleted = False

    def put(self, row: Row) -> None:
        if len(self._rows) >= _WAITING:
            self._rows.popleft()
            self.lost += 1
        self._rows.append(row)

    def write(self, *, sync: bool) -> str:
        """Write the waiting rows; return the fault, or an empty string."""
        rows = []
        while self._rows:
            rows.append(self._rows.popleft())
        if self._deleted:
            self.lost += len(rows)
            return self._fault("it has been deleted")
        try:
            if self._torn:
                self._cut()
            if rows:
                self._append("".join(map(self._print, rows)).encode())
            if sync:
                os.fsync(self._descriptor)
                # Writing to a deleted file succeeds without effect.
                self._deleted = os.fstat(self._descriptor).st_nlink == 0
        except OSError as error:
            self._requeue(rows)
            with suppress(OSError):
                self._cut()
            return self._fault((error.strerror or str(error)).lower())
        return self._fault("it has been deleted") if self._deleted else ""

    def _fault(self, reason: str) -> str:
        return f"{self.path}: cannot be written: {reason}"

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
            self.lost += len(self._rows)
            self._rows.clear()

    def _append(self, data: bytes) -> None:
        self._torn = True
        view = memoryview(data)
        while view:
            view = view[os.write(self._descriptor, view) :]
        self._size += len(data)
        self._torn = False

    def _cut(self) -> None:
        """Cut back to the last complete row."""
        os.ftruncate(self._descriptor, self._size)
        self._torn = False

    def _requeue(self, rows: list[Row]) -> None:
        if self._torn:  # otherwise they are written but not yet synced
            self._rows.extendleft(reversed(rows))
        while len(self._rows) > _WAITING:
            self._rows.popleft()
            self.lost += 1

    def _print(self, row: Row) -> str:
        if all(type(value) is float and value == value for value in row):
            return self._line % row
        return "\t".join(map(_cell, self._forms, row)) + "\n"


def _cell(form: str, value: float | str) -> str:
    if isinstance(value, str):
        # No tabs or line breaks within a cell.
        return " ".join(value.split()) or "n/a"
    return form % value if value == value else "n/a"
