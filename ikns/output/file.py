"""Output files: they appear whole or not at all, and overwrite nothing unasked."""

from __future__ import annotations

import csv
import errno
import io
import os
import secrets
from collections.abc import Iterable, Sequence
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.output.inputs import refuse_input

#: What a file system answers that has no hard links.
_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)


def refuse_overwriting(
    path: Path,
    *,
    force: bool,
    inputs: Iterable[Path | str | None],
    endings: Sequence[str] = (),
) -> None:
    """Check, before any work, that a file may be written.

    Parameters
    ----------
    path : Path
        The file to write.
    force : bool
        Whether an existing file may be replaced.
    inputs : iterable of Path, str or None
        Everything that is read, files and folders: never replaced.
    endings : sequence of str
        Those of the formats that are written, in lower case; by default any.

    Raises
    ------
    InvalidInput
        When it exists and `force` is not set, it is one of the inputs under whatever
        name, it is not a file, its ending is another, or its folder does not exist.
    """
    if path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a file, found a folder.")
    if path.exists() and not path.is_file():
        raise InvalidInput(f"{path}: expected the name of a file, found a device.")
    if os.path.lexists(path):
        refuse_input(path, inputs)
    if endings:
        check_ending(path, endings)
    if os.path.lexists(path):
        if not force:
            raise InvalidInput(f"{path}: exists already; use --force to overwrite it.")
    check_parent(path)


def check_parent(path: Path) -> None:
    """Refuse a new file or folder where there is no folder for it."""
    if not path.absolute().parent.is_dir():
        there = path.parent.exists()
        why = "is a file; give a folder" if there else "does not exist; make it first"
        raise InvalidInput(
            f"{path}: {'' if there else 'the folder '}{path.parent} {why}."
        )


def check_ending(path: Path, endings: Sequence[str]) -> None:
    """Refuse a name whose ending is none of these, given in lower case.

    >>> check_ending(Path("signal.CSV"), [".csv"])
    """
    if path.suffix.lower() not in endings:
        *rest, last = endings
        known = f"{', '.join(rest)} or {last}" if rest else last
        found = path.suffix or "no ending"
        raise InvalidInput(
            f"{path}: expected a name that ends in {known}, found {found}."
        )


def write_text(path: Path, text: str, *, force: bool = True) -> None:
    """Write a text file in UTF-8; see :func:`write_bytes`."""
    write_bytes(path, text.encode("utf-8"), force=force)


def write_bytes(path: Path, content: bytes, *, force: bool = True) -> None:
    """Write a file, whole or not at all: an interruption loses neither old nor new.

    Parameters
    ----------
    path : Path
    content : bytes
    force : bool
        Whether to replace a file that is there.

    Raises
    ------
    InvalidInput
        When it is there and `force` is not set.
    OSError
        When it cannot be written.
    """
    if not force:
        if not create_bytes(path, content):
            raise InvalidInput(
                f"{path}: another program has written it in the meantime; use --force "
                "to overwrite it."
            )
        return
    part = _write_part(path, content)
    try:
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    sync(path.parent)


def create_bytes(path: Path, content: bytes) -> bool:
    """Write a new file, whole or not at all; of several writers one succeeds.

    Returns
    -------
    bool
        False when the file was there already; it stays as it was.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    part = _write_part(path, content)
    try:
        os.link(part, path)
    except FileExistsError:
        return False
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        return _claim(path, part)
    finally:
        part.unlink(missing_ok=True)
    sync(path.parent)
    return True


def write_csv(
    path: Path,
    columns: Sequence[str],
    rows: Iterable[Sequence[float]],
    *,
    force: bool = True,
) -> None:
    """Write a table of numbers; NaN becomes an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    # One format for a row takes half the time of one for each cell.
    cells = ",".join(["%.9g"] * len(columns))
    for row in rows.tolist() if hasattr(rows, "tolist") else rows:
        # As csv writes it, with quotes where a line would be empty.
        text.write(((cells % tuple(row)).replace("nan", "") or '""') + "\n")
    write_text(path, text.getvalue(), force=force)


def sync(path: Path) -> None:
    """Flush a file, or the names in a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot
            raise
    finally:
        os.close(descriptor)


def _write_part(path: Path, content: bytes) -> Path:
    """Write a file under a hidden name next to its own and flush it to the disk."""
    # The length of a name is limited.
    part = path.with_name(
        f".{path.name[:40]}.{os.getpid()}.{secrets.token_hex(4)}.part"
    )
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        part.unlink(missing_ok=True)
        # The hidden name tells no one anything.
        raise OSError(error.errno, error.strerror, str(path)) from None
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return part


def _claim(path: Path, part: Path) -> bool:
    """Take a name that is free, then the content, where there are no hard links."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except FileExistsError:
        return False
    try:
        part.replace(path)
    except OSError:
        path.unlink(missing_ok=True)
        raise
    sync(path.parent)
    return True
