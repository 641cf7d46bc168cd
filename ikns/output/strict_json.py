"""JSON that every parser reads: numbers that are not finite become null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def strict_json(value: Any, *, indent: int | None = None) -> str:
    """Return strict JSON; NaN and infinities, which JSON does not have, become null.

    Parameters
    ----------
    value : object
        Mappings, sequences, arrays, text, numbers and paths, nested in any way.
    indent : int, optional
        Spaces per level; without it the text has no spaces at all.

    Examples
    --------
    >>> strict_json({"c": float("nan"), "trials": (1, 2)})
    '{"c":null,"trials":[1,2]}'
    """
    separators = (",", ":") if indent is None else None
    return json.dumps(
        _plain(value), indent=indent, separators=separators, allow_nan=False
    )


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value
