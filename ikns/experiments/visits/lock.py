"""The lock of a visit: one program conducts it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ikns.errors import FileError, InvalidInput, plain
from ikns.output.lock import hold_lock

#: Name of the lock file in the visit's folder.
LOCK = ".lock"


@contextmanager
def visit_lock(folder: str | Path) -> Iterator[None]:
    """Hold a visit while it is conducted; its folder is made when missing.

    A folder that was made and in which nothing was written is removed at the end.

    Parameters
    ----------
    folder : str or Path
        Of the visit.

    Raises
    ------
    InvalidInput
        When another process conducts the visit, or there is a file instead.
    FileError
        When the folder cannot be made.
    """
    path = Path(folder)
    if path.exists() and not path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a folder, found a file.")
    new = [place for place in (path, *path.parents) if not place.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be created: {plain(error)}.") from None
    try:
        with hold_lock(path / LOCK, "to conduct a visit"):
            yield
    finally:
        with suppress(OSError):  # not empty
            for place in new:
                place.rmdir()
