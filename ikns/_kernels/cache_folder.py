"""Folders of machine code, one for each version of a kernel file.

Numba keys its cache by the file of a function and ignores the files of what it calls.
So a folder here is named after a hash of the sources of a kernel file and of all kernel
files that it imports, and machine code of another version is never loaded.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
import sys
from pathlib import Path
from typing import Any

import llvmlite
import numba

from ikns._kernels.machine_code import SUFFIX, is_private, say_once

config: Any = numba.config
#: Version of the files.
_FORMAT = 2
_HERE = Path(__file__).parent
_IMPORT = re.compile(r"^from ikns\._kernels\.([\w.]+) import", re.MULTILINE)


def on_disk(module: str) -> bool:
    """Whether machine code of a kernel file, such as "body.step", is cached on disk."""
    folder = cache_folder(module)
    return folder is not None and any(folder.glob(f"*{SUFFIX}"))


def can_keep(module: str) -> bool:
    """Whether there is a folder for machine code of a kernel file."""
    return cache_folder(module) is not None


@functools.cache
def _source(path: Path) -> tuple[str, set[str]]:
    """Return a kernel file's text and which kernel files it imports."""
    text = path.read_text(encoding="utf-8")
    return text, set(_IMPORT.findall(text))


def version(module: str) -> str:
    """Return a hash of all that machine code of a kernel file follows from."""
    texts: dict[str, str] = {}
    pending = [module]
    while pending:
        name = pending.pop()
        path = _HERE.joinpath(*name.split(".")).with_suffix(".py")
        texts[name], imported = _source(path)
        pending += imported - set(texts)
    sources = "".join(texts[name] for name in sorted(texts))
    sources += f"{numba.__version__} {llvmlite.__version__} {sys.version} {_FORMAT}"
    return hashlib.sha256(sources.encode()).hexdigest()[:16]


@functools.cache
def cache_folder(module: str) -> Path | None:
    """Cache folder for these sources; None where no folder is writable."""
    name = f"{module}-{version(module)}"
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    asked = config.CACHE_DIR
    places = [asked] if asked else [_HERE / "__pycache__", Path(home) / "ikns"]
    for place in places:
        folder = Path(place) / name
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            private = is_private(folder)
        except OSError:
            continue
        if not private:
            say_once(
                "not private",
                f"{folder}: expected a folder that no one else can write to, found "
                "another; machine code is not stored there.",
            )
        elif os.access(folder, os.W_OK):
            return folder
    return None
