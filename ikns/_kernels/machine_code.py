"""Machine code on disk: one checked file for each kernel and types of its arguments.

Numba's own cache trusts its files, so that one that a power cut left half written, or a
disk changed, ends every later program. It also has an index that two processes which
compile at once overwrite. Here a file begins with the SHA-256 of its name and content,
and its name follows from what it holds, so there is no index.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from ikns._kernels.linking import called_by, load_called

SUFFIX = ".nbc"
#: Length of a SHA-256, bytes.
_DIGEST = 32
#: Kinds of sentences that this process has printed.
_SAID: set[str] = set()


class KernelCache:
    """What a numba dispatcher takes for its cache.

    Parameters
    ----------
    function : callable
        The kernel, not compiled.
    folder : Path
        For these very sources, see :func:`ikns._kernels.cache_folder.cache_folder`;
        exists, and no one else can write to it: what is loaded is run.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._function, self._folder = function, folder

    @property
    def cache_path(self) -> str:
        """Folder of the files."""
        return str(self._folder)

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return compiled code for a signature, None if there is none or no whole one.

        A damaged file is removed, which is said on stderr.
        """
        # All that machine code needs of numba. Compiling loads the rest by itself,
        # which takes longer than most commands.
        rtsys.initialize(target_context)
        path = self._path(signature, target_context.codegen())
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        digest, code = content[:_DIGEST], content[_DIGEST:]
        if digest == _digest(path, code):
            with suppress(Exception):  # of another version of llvmlite, say
                called, parts = pickle.loads(code)
                if load_called(called, target_context.codegen()):
                    return CompileResult._rebuild(target_context, *parts)
        with suppress(OSError):
            path.unlink()
        say_once(
            "damaged",
            f"{path}: expected machine code as it was stored, found a damaged file; it "
            "was removed and is compiled again.",
        )
        return None

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep compiled code; where that fails it is compiled again next time."""
        if any(not each.can_cache for each in result.lifted):
            return
        if result.library.has_dynamic_globals:  # addresses of this process
            return
        path = self._path(signature, result.codegen)
        code = dumps((called_by(result), result._reduce()))
        try:
            with tempfile.NamedTemporaryFile(
                dir=self._folder, prefix=f".{path.stem}.", delete=False
            ) as file:
                part = Path(file.name)
                try:
                    file.write(_digest(path, code) + code)
                    file.flush()
                    part.replace(path)
                except BaseException:
                    part.unlink(missing_ok=True)
                    raise
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            say_once(
                "not kept",
                f"{self._folder}: machine code cannot be stored: {reason}; "
                "it is compiled again next time.",
            )

    def flush(self) -> None:
        """Forget nothing: files of other sources are in other folders."""

    def _path(self, signature: Any, codegen: Any) -> Path:
        """Return the file of a signature on this processor."""
        made_for = repr((signature, codegen.magic_tuple()))
        name = hashlib.sha256(made_for.encode()).hexdigest()[:16]
        return self._folder / f"{self._function.__name__}-{name}{SUFFIX}"


def is_private(folder: Path) -> bool:
    """Whether a folder is the user's own, and no one else can write to it.

    Machine code is run without being looked at, so it must come from the user.
    """
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    mine = stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid()
    return mine and not found.st_mode & others


def say_once(kind: str, sentence: str) -> None:
    """Print a sentence on stderr, the first of its kind only."""
    if kind not in _SAID:
        _SAID.add(kind)
        sys.stderr.write(f"ikns: {sentence}\n")


def _digest(path: Path, code: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + b"\0" + code).digest()
