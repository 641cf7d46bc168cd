"""statsmodels, loaded when a test needs it: it and pandas take seconds."""

from __future__ import annotations

import importlib
from typing import Any

from ikns.errors import InvalidInput


def statsmodels(module: str) -> Any:
    """Import a module of statsmodels by its path below the package."""
    try:
        return importlib.import_module(f"statsmodels.{module}")
    except ImportError:
        raise InvalidInput(
            "this test needs statsmodels, which pip install 'ikns[study]' brings."
        ) from None
