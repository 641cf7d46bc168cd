"""Compilation of kernels: numba, cached on disk, without the GIL.

Numba keys its cache by the file of a function and ignores the files of what it calls.
So the cache is in a folder named after a hash of the sources of a kernel and of all
kernels that it imports, and machine code of another version is never loaded.
`machine_code` has the files in it.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import llvmlite
import numba
from numba.core.types import unliteral

from ikns._kernels.machine_code import SUFFIX, KernelCache, is_private, say_once

config: Any = numba.config
#: Version of the files.
_FORMAT = 1
_HERE = Path(__file__).parent
_IMPORT = re.compile(r"^from ikns\._kernels\.([\w.]+) import", re.MULTILINE)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function on its first call; division by zero gives inf or NaN.

    A function whose name begins with an underscore is called by kernels only, as are
    those of :func:`inner`.
    """
    return _compiled(function, wrapped=not function.__name__.startswith("_"))


def inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of which other kernel files make use, and Python never does.

    It gets no wrapper for Python, which would unpack tuples of many arrays.
    """
    return _compiled(function, wrapped=False)


def borrowing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that makes no array and returns none.

    Numba counts the references to each array of each tuple that is passed on, which
    took an eighth of a frame. Such a function only borrows them and does not count.
    """
    wrapped = not function.__name__.startswith("_")
    return _compiled(function, wrapped=wrapped, counting=False)


def inner_borrowing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that is both :func:`inner` and :func:`borrowing`."""
    return _compiled(function, wrapped=False, counting=False)


def _compiled(
    function: Callable[..., Any], *, wrapped: bool, counting: bool = True
) -> Callable[..., Any]:
    folder = _cache_folder(function.__module__.removeprefix("ikns._kernels."))
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "no_cpython_wrapper": not wrapped,
        "no_cfunc_wrapper": True,
        "_nrt": counting,
    }
    kernel: Any = numba.njit(**options)(function)
    _take_constants_as_values(kernel)
    if folder is not None:
        # As `cache=True` does, with numba's own cache.
        kernel._cache = KernelCache(function, folder)
    return cast("Callable[..., Any]", kernel)


def _take_constants_as_values(kernel: Any) -> None:
    """Do not compile a kernel anew for each constant that another kernel passes to it.

    Numba takes ``f(x, True)`` in compiled code for a type of argument of its own. The
    whole solver was compiled twice so, a sixth of all the time.
    """
    template = kernel.get_call_template

    def of_values(args: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        values = tuple(unliteral(argument) for argument in args)
        named = {name: unliteral(argument) for name, argument in keywords.items()}
        return template(values, named)

    kernel.get_call_template = of_values


def on_disk(module: str) -> bool:
    """Whether machine code of a kernel file, such as "body.step", is cached on disk."""
    folder = _cache_folder(module)
    return folder is not None and any(folder.glob(f"*{SUFFIX}"))


def can_keep(module: str) -> bool:
    """Whether there is a folder for machine code of a kernel file."""
    return _cache_folder(module) is not None


@functools.cache
def _source(path: Path) -> tuple[str, set[str]]:
    """Return a kernel file's text and which kernel files it imports."""
    text = path.read_text(encoding="utf-8")
    return text, set(_IMPORT.findall(text))


@functools.cache
def _cache_folder(module: str) -> Path | None:
    """Cache folder for these sources; None where no folder is writable."""
    texts: dict[str, str] = {}
    pending = [module]
    while pending:
        name = pending.pop()
        path = _HERE.joinpath(*name.split(".")).with_suffix(".py")
        texts[name], imported = _source(path)
        pending += imported - set(texts)
    sources = "".join(texts[name] for name in sorted(texts))
    sources += f"{numba.__version__} {llvmlite.__version__} {sys.version} {_FORMAT}"
    name = f"{module}-{hashlib.sha256(sources.encode()).hexdigest()[:16]}"
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
