"""Folders of results, written completely or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ikns.errors import FileError, InvalidInput, plain
from ikns.output.file import check_parent, sync
from ikns.output.inputs import refuse_input_folder


def check_output_folder(
    folder: str | Path,
    files: Sequence[str],
    *,
    force: bool,
    inputs: Iterable[Path | str | None] = (),
) -> None:
    """Check, before any work, that a folder may be written.

    Parameters
    ----------
    folder : str or Path
        Folder for the results.
    files : sequence of str
        Every file that such a folder may hold, relative to it.
    force : bool
        Whether to replace a folder of that kind.
    inputs : iterable of Path, str or None
        Everything that is read, files and folders: never replaced.

    Raises
    ------
    InvalidInput
        When something is in the way that `force` does not cover: a file, the current
        folder, or one that holds an input or anything else. So no run deletes what no
        run wrote.
    """
    target = Path(folder)
    check_parent(target)
    if not target.exists():
        return
    if not target.is_dir():
        raise InvalidInput(f"{target}: expected the name of a folder, found a file.")
    if Path.cwd().is_relative_to(target.resolve()):
        raise InvalidInput(f"{target}: expected a folder other than the current one.")
    refuse_input_folder(target, inputs)
    found = [path for path in sorted(target.rglob("*")) if not path.is_dir()]
    for path in found:
        if path.relative_to(target).as_posix() not in files:
            raise InvalidInput(
                f"{target}: expected a new folder, found one that holds "
                f"{path.relative_to(target)}; choose another name."
            )
    if found and not force:
        raise InvalidInput(f"{target}: exists already; use --force to overwrite it.")


@contextmanager
def output_folder(folder: str | Path) -> Iterator[Path]:
    """Provide a temporary folder that replaces the folder on exit without error.

    An existing folder is not changed until then, nor when there is an error.

    Parameters
    ----------
    folder : str or Path
        Folder for the results, checked by :func:`check_output_folder`.

    Raises
    ------
    FileError
        When the folder cannot be written.
    """
    target = Path(folder).resolve()
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    old = part.with_suffix(".old")
    try:
        part.mkdir()
        yield part
        # On the disk before the earlier folder goes.
        for path in (*part.rglob("*"), part):
            sync(path)
        if target.exists():
            target.rename(old)
        try:
            part.rename(target)
        except OSError:
            if old.exists():
                old.rename(target)
            raise
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        raise FileError(f"{folder}: cannot be written: {plain(error)}.") from None
    finally:
        shutil.rmtree(part, ignore_errors=True)
