"""What a command reads, it never replaces, whatever name the file goes by."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from ikns.errors import InvalidInput

#: Device and number of a file on it: the same for all names of one file.
Identity = tuple[int, int]


def refuse_input(path: Path, inputs: Iterable[Path | str | None]) -> None:
    """Refuse to replace a file that is read, or one in a folder that is read.

    Files are compared by identity, so links, relative paths, other spellings on a file
    system that ignores case, and ``/dev/stdin`` make no difference.

    Parameters
    ----------
    path : Path
        The file to write.
    inputs : iterable of Path, str or None
        Files and folders; None is no input.

    Raises
    ------
    InvalidInput
        When it is one of them or in one of them.
    """
    own = _identity(path)
    if own is None:  # a new file
        return
    for source in _given(inputs):
        held = source.rglob("*") if source.is_dir() else [source]
        if any(_identity(each) == own for each in held if not each.is_dir()):
            name = "" if str(path) == str(source) else f", {source}"
            raise InvalidInput(
                f"{path}: this file is also an input{name}; give the output another "
                "name."
            )


def refuse_input_folder(folder: Path, inputs: Iterable[Path | str | None]) -> None:
    """Refuse to replace a folder that is read, or that holds what is read.

    Raises
    ------
    InvalidInput
        When an input is the folder, lies in it, or is a file of it under another name.
    """
    own = _identity(folder)
    if own is None:
        return
    held = {_identity(path) for path in folder.rglob("*") if not path.is_dir()}
    for source in _given(inputs):
        place = source.resolve()
        around = {_identity(each) for each in (place, *place.parents)}
        if own in around or (not source.is_dir() and _identity(source) in held):
            found = f"this folder holds {source}, which is an input"
            if str(folder) == str(source):
                found = "this folder is also an input"
            raise InvalidInput(f"{folder}: {found}; give the output another name.")


def no_such_folder(path: Path, kind: str, remedy: str) -> str:
    """Say that a path is no folder of some kind, and which one to give.

    >>> no_such_folder(Path("none"), "a session", "one that `ikns run` recorded")
    'none: no such folder; give one that `ikns run` recorded.'
    """
    found = "this is a file" if path.exists() else "no such folder"
    if path.is_dir():
        found = f"this is not {kind}"
    return f"{path}: {found}; give {remedy}."


def _given(inputs: Iterable[Path | str | None]) -> Iterator[Path]:
    """Yield the inputs that exist; a missing one is reported by who reads it."""
    for source in inputs:
        if source is not None and _identity(Path(source)) is not None:
            yield Path(source)


def _identity(path: Path) -> Identity | None:
    """Return which file a path leads to; None where it leads to none."""
    try:
        found = path.stat()
    except (OSError, ValueError):  # a null byte, in the name of a marker set say
        return None
    return found.st_dev, found.st_ino
