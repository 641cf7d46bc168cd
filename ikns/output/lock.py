"""A lock for what only one program may write at a time."""

from __future__ import annotations

import fcntl
import json
import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ikns.errors import FileError, InvalidInput, plain


def _print(sentence: str) -> None:
    sys.stderr.write(f"ikns: {sentence}\n")


@contextmanager
def hold_lock(
    path: Path, what: str, *, on_takeover: Callable[[str], None] = _print
) -> Iterator[None]:
    """Hold a lock file, which names this process, and remove it at the end.

    The system releases the lock of a process that ends in whatever way. What is then
    left is a file that names it, which the next process on the same computer replaces.

    Parameters
    ----------
    path : Path
        The lock file; its folder must exist.
    what : str
        What only one program may do at a time, as in "to record a session".
    on_takeover : callable
        Called with a sentence when the lock of a dead process is taken over. Default:
        it goes to stderr.

    Raises
    ------
    InvalidInput
        When another process holds it; the sentence names that process.
    FileError
        When it cannot be written.
    """
    try:
        descriptor, sure = _open_locked(path, what)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {plain(error)}.") from None
    try:
        before = _holder(descriptor)
        if before is not None:
            pid, host = before
            dead = sure or not _alive(pid)
            if host != socket.gethostname() or not dead:
                raise _refused(path, what, before)
            on_takeover(
                f"{path.parent}: was still locked by process {pid}, which has ended; "
                "the lock was taken over."
            )
        try:
            _write_holder(descriptor)
        except OSError as error:
            raise FileError(f"{path}: cannot be written: {plain(error)}.") from None
        try:
            yield
        finally:
            with suppress(OSError):  # its folder is gone
                path.unlink()
    finally:
        os.close(descriptor)


def _open_locked(path: Path, what: str) -> tuple[int, bool]:
    """Open or make the lock file and lock it; False where the system has no locks."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Its last holder may have removed it after it was opened here.
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor, True
        except BlockingIOError:
            holder = _holder(descriptor)
            os.close(descriptor)
            raise _refused(path, what, holder) from None
        except FileNotFoundError:
            pass
        except OSError:  # the names of process and computer must do
            return descriptor, False
        os.close(descriptor)


def _holder(descriptor: int) -> tuple[int, str] | None:
    """Return the process and computer that a lock file names, None if none."""
    try:
        named = json.loads(os.pread(descriptor, 4096, 0))
        return int(named["pid"]), str(named["host"])
    except (OSError, ValueError, LookupError, TypeError):
        return None  # new, or torn by a power cut


def _write_holder(descriptor: int) -> None:
    named = json.dumps({"pid": os.getpid(), "host": socket.gethostname()}) + "\n"
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, named.encode(), 0)
    os.fsync(descriptor)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _refused(path: Path, what: str, holder: tuple[int, str] | None) -> InvalidInput:
    who = "" if holder is None else f", process {holder[0]} on {holder[1]}"
    advice = "wait until it ends"
    if holder is not None and holder[1] != socket.gethostname():
        advice = f"if it is no longer running, remove {path}"
    return InvalidInput(
        f"{path.parent}: expected {what} in one program at a time, found another run"
        f"{who}; {advice}."
    )
