"""A file to which rows are appended: complete ones only, whatever the disk does."""

from __future__ import annotations

import errno
import os
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ikns.errors import plain
from ikns.live.session.channels import Channel

Row = tuple[float | str, ...]

#: Rows that wait in memory while the file cannot be written: ten minutes at 100 Hz.
_WAITING = 60_000
#: Rows that are formatted and written at once. While the disk is full, no more of them
#: are formatted again and again.
_BATCH = 1000
#: Longest end of a file that is searched for its last complete row, bytes.
_TAIL = 1 << 16
#: Bytes that are read at once to count rows.
_CHUNK = 1 << 20


class RowFile:
    """One file and the rows waiting for it.

    :meth:`put` may be called by one thread while another one calls the other methods.

    Parameters
    ----------
    path : Path
        Must exist, empty or with a header.
    channels : sequence of Channel

    Attributes
    ----------
    width : int
        Number of columns.
    rows : int
        Number of rows handed over.
    dropped : int
        Number of rows that were given up because too many waited.
    fault : str
        Why it cannot be written, or what another program did to it; else empty.
    """

    def __init__(self, path: Path, channels: Sequence[Channel]) -> None:
        self.path, self.width = path, len(channels)
        self.rows = self.dropped = 0
        self.fault = ""
        self._forms = [channel.form for channel in channels]
        self._line = "\t".join(self._forms) + "\n"
        self._queue: deque[Row] = deque()
        self._lines: deque[bytes] = deque()  # formatted, not written
        self._unsynced: list[bytes] = []  # written, maybe not on the disk yet
        self._descriptor = os.open(path, os.O_RDWR | os.O_APPEND)
        self._size = self._synced = os.fstat(self._descriptor).st_size
        self._header = _count_lines(path)
        self._torn = self._sync_failed = False
        self._change = ""

    def put(self, row: Row) -> None:
        """Append a row, without waiting."""
        if len(self._queue) >= _WAITING:
            with suppress(IndexError):  # the other thread was faster
                self._queue.popleft()
                self.dropped += 1
        self._queue.append(row)
        self.rows += 1

    def write(self, *, sync: bool) -> None:
        """Write the waiting rows, and flush them to the disk if `sync`.

        What cannot be written waits for the next call; :attr:`fault` says why.
        """
        try:
            if self._torn:
                self._cut(self._size)
            self._check_size()
            sync |= self._sync_failed
            if self._sync_failed:
                self._take_back()
            while self._format():
                self._append()
            if sync:
                self._sync()
        except OSError as error:
            self.fault = f"cannot be written: {plain(error)}"
        else:
            self.fault = self._place_fault() or self._change

    def close(self) -> None:
        """Close the file; harmless when repeated."""
        if self._descriptor < 0:
            return
        descriptor, self._descriptor = self._descriptor, -1
        try:
            os.close(descriptor)
        except OSError as error:  # where a quota is checked only now
            self.fault = f"cannot be written: {plain(error)}"

    def lost(self) -> int:
        """Count the rows handed over that are not in the file: it is read."""
        return max(0, self.rows - max(0, _count_lines(self.path) - self._header))

    def _format(self) -> bool:
        """Format waiting rows; return whether there are any."""
        while len(self._lines) < _BATCH and self._queue:
            self._lines.append(self._print(self._queue.popleft()).encode())
        return bool(self._lines)

    def _append(self) -> None:
        """Write the formatted rows; those that fit stay when the disk is full."""
        data = b"".join(self._lines)
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._descriptor, left) :]
        finally:
            written = len(data) - len(left)
            while self._lines and len(self._lines[0]) <= written:
                line = self._lines.popleft()
                written -= len(line)
                self._size += len(line)
                self._unsynced.append(line)
            if written:
                self._torn = True
                with suppress(OSError):
                    self._cut(self._size)

    def _sync(self) -> None:
        try:
            os.fsync(self._descriptor)
        except OSError as error:
            if error.errno == errno.EINVAL:  # a file system that cannot
                return
            self._sync_failed = True
            raise
        self._unsynced.clear()
        self._synced = self._size

    def _take_back(self) -> None:
        """Write rows again that a failed sync may have lost.

        Linux takes them for written after having reported the failure once, see
        fsync(2), so that another sync alone would succeed without effect.
        """
        self._cut(self._synced)
        self._lines.extendleft(reversed(self._unsynced))
        self._unsynced.clear()
        self._sync_failed = False

    def _cut(self, size: int) -> None:
        """Cut back to the end of a complete row."""
        os.ftruncate(self._descriptor, size)
        self._size = size
        self._torn = False

    def _check_size(self) -> None:
        """Notice that another program cut the file or wrote into it."""
        size = os.fstat(self._descriptor).st_size
        if size == self._size:
            return
        self._change = f"another program changed it, from {self._size} to {size} bytes"
        self._unsynced.clear()
        self._sync_failed = False
        start = max(0, size - _TAIL)
        tail = os.pread(self._descriptor, size - start, start)
        # The next row begins a new line.
        self._cut(start + tail.rfind(b"\n") + 1)
        self._synced = self._size

    def _place_fault(self) -> str:
        """Say whether the open file is still the one of that name."""
        # Writing to a file that is gone from its place succeeds without effect.
        own = os.fstat(self._descriptor)
        try:
            if os.path.samestat(own, self.path.stat()):
                return ""
        except OSError:
            if own.st_nlink == 0:
                return "cannot be written: it has been deleted"
        return "cannot be written: another program moved or replaced it"

    def _print(self, row: Row) -> str:
        if all(type(value) is float and value == value for value in row):
            return self._line % row
        return "\t".join(map(_cell, self._forms, row)) + "\n"


def _cell(form: str, value: float | str) -> str:
    if isinstance(value, str):
        # No tabs or line breaks within a cell.
        return " ".join(value.split()) or "n/a"
    return form % value if value == value else "n/a"


def _count_lines(path: Path) -> int:
    """Count the complete lines of a file; 0 where it cannot be read."""
    count = 0
    with suppress(OSError), path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            count += chunk.count(b"\n")
    return count
