"""Compilation of kernels: numba, cached on disk, without the GIL.

Numba keys its cache by the file of a function and ignores the files of what it calls.
So the cache is in a folder named after a hash of the sources of a kernel and of all
kernels that it imports, and machine code of another version is never loaded.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

__all__ = ["compiled", "on_disk"]

config: Any = numba.config
_HERE = Path(__file__).parent
_IMPORT = re.compile(r"^from ikns\._kernels\.([\w.]+) import", re.MULTILINE)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function on its first call; division by zero gives inf or NaN.

    A function whose name begins with an underscore is called by kernels only and gets
    no wrapper for Python, which takes a fifth of the time to compile.
    """
    folder = _cache_folder(function.__module__.removeprefix("ikns._kernels."))
    asked = config.CACHE_DIR
    config.CACHE_DIR = str(folder or "")
    try:
        options: dict[str, Any] = {
            "nogil": True,
            "error_model": "numpy",
            "cache": folder is not None,
            "no_cpython_wrapper": function.__name__.startswith("_"),
            "no_cfunc_wrapper": True,
        }
        kernel: Callable[..., Any] = numba.njit(**options)(function)
        return kernel
    finally:
        config.CACHE_DIR = asked


def on_disk(module: str) -> bool:
    """Whether machine code of a kernel file, such as "body.step", is cached on disk."""
    folder = _cache_folder(module)
    return folder is not None and any(folder.rglob("*.nbc"))


@functools.cache
def _cache_folder(module: str) -> Path | None:
    """Cache folder for these sources; None where no folder is writable."""
    texts: dict[str, str] = {}
    pending = [module]
    while pending:
        name = pending.pop()
        path = _HERE.joinpath(*name.split(".")).with_suffix(".py")
        texts[name] = path.read_text(encoding="utf-8")
        pending += set(_IMPORT.findall(texts[name])) - set(texts)
    sources = "".join(texts[name] for name in sorted(texts)) + numba.__version__
    name = f"{module}-{hashlib.sha256(sources.encode()).hexdigest()[:16]}"
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    asked = config.CACHE_DIR
    places = [asked] if asked else [_HERE / "__pycache__", Path(home) / "ikns"]
    for place in places:
        folder = Path(place) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None
