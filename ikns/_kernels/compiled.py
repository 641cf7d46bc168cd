"""The one way in which kernels are compiled: numba, kept on disk, free of the GIL.

Numba keys its cache by the file that holds a function and knows nothing of the files
that hold what it calls. So the cache lies in a folder named after all of the kernels'
sources, and machine code from another version of any of them is never loaded.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import config, njit

__all__ = ["compiled"]

_HERE = Path(__file__).parent


def _cache_folder() -> Path | None:
    """Where machine code of these very sources is kept; None where nothing can be."""
    sources = b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))
    name = "ikns-" + hashlib.sha256(sources + numba.__version__.encode()).hexdigest()
    asked = config.CACHE_DIR
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    places = [asked] if asked else [_HERE / "__pycache__", Path(home) / "ikns"]
    for place in places:
        folder = Path(place) / name[:21]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None


_FOLDER = _cache_folder()


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function on its first call; division by zero gives inf or NaN."""
    asked = config.CACHE_DIR
    config.CACHE_DIR = str(_FOLDER or "")
    try:
        return njit(cache=_FOLDER is not None, error_model="numpy", nogil=True)(
            function
        )
    finally:
        config.CACHE_DIR = asked
