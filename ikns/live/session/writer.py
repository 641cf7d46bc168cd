"""Append rows to the files of a run without waiting for the disk.

Rows go into a queue; a thread formats them, writes them five times per second and syncs
the files once per second. A killed process loses what is in the queue; a machine that
loses power, about a second. Rows are written completely or not at all: after a fault
(such as a full disk) the file is cut back to its last complete row, rows wait in
memory, and the thread tries again. Files that another program deletes, moves, replaces
or changes are reported too. How many rows are missing is counted in the closed files.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.live.session.channels import Channel
from ikns.live.session.row_file import RowFile

#: Time between writes, and between syncs to the disk, s.
_FLUSH, _SYNC = 0.2, 0.8


class RunWriter:
    """Files of one run, to which rows are appended.

    Parameters
    ----------
    files : mapping of name to (path, channels)
        Each file must exist, empty or with a header.
    on_fault : callable, optional
        Called from the writing thread with a message when a file cannot be written or
        was changed by another program, and again when all is well.

    Attributes
    ----------
    fault : str
        Present fault; empty if there is none.
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
            name: RowFile(path, channels) for name, (path, channels) in files.items()
        }
        self._lost: dict[str, int] | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Number of rows that are missing on disk; before closing, that were dropped.

        Rows that still wait count when the writer is closed, and so do those that
        another program removed.
        """
        if self._lost is None:
            return sum(file.dropped for file in self._files.values())
        return sum(self._lost.values())

    @property
    def losses(self) -> list[str]:
        """One sentence per file that lacks rows or had a fault in the end.

        They are complete once the writer is closed.
        """
        found = []
        for name, file in self._files.items():
            lost = file.dropped if self._lost is None else self._lost[name]
            reason = f" ({file.fault})" if file.fault else ""
            if lost:
                found.append(
                    f"{file.path}: {lost} of {file.rows} rows are missing{reason}."
                )
            elif file.fault:
                found.append(f"{file.path}: {file.fault}.")
        return found

    def rows(self, name: str) -> int:
        """Return how many rows were handed over for a file."""
        return self._files[name].rows

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
        """Write and sync all rows, and count those on disk; harmless when repeated."""
        self._closing.set()
        self._thread.join()
        if self._lost is None:
            for file in self._files.values():
                file.close()
            self._lost = {name: file.lost() for name, file in self._files.items()}

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
            for file in self._files.values():
                file.write(sync=sync)
            if sync:
                synced = time.monotonic()
            self._report(
                "; ".join(
                    f"{f.path}: {f.fault}" for f in self._files.values() if f.fault
                )
            )
            if last:
                return

    def _report(self, fault: str) -> None:
        if fault != self.fault:
            self.fault = fault
            if self._on_fault:
                self._on_fault(fault or "the session is being written again.")
