"""Import a client library that only one kind of source needs."""

from __future__ import annotations

import importlib
from typing import Any

from ikns.errors import StreamError


def load_client(module: str, *, needed_by: str, remedy: str) -> Any:
    """Import a module, or raise an error that says what to install.

    >>> load_client("no_such_module", needed_by="vicon:HOST", remedy="install it")
    Traceback (most recent call last):
    ikns.errors.StreamError: vicon:HOST needs no_such_module; install it.
    """
    try:
        return importlib.import_module(module)
    # An installed library that cannot load its binary part raises the latter two.
    except (ImportError, OSError, RuntimeError) as error:
        why = "" if isinstance(error, ModuleNotFoundError) else f" ({error})"
        raise StreamError(f"{needed_by} needs {module}{why}; {remedy}.") from None
