"""Checks of the values of options, the same for every command."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

from typer.models import ArgumentInfo

from ikns.errors import InvalidInput

#: Options whose value is above zero.
_POSITIVE = (
    *("--cutoff", "--duration", "--hold-speed", "--limit", "--max-uncertainty"),
    *("--radius", "--speed"),
)


def checked(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that refuses values which no option can mean.

    These are numbers that are not finite, or not above zero where they must be, and
    names that are not text in UTF-8, which no file of results could hold. A value that
    the option has by default is right.

    Examples
    --------
    >>> def jump(height: float = 1.0) -> None:
    ...     print(height)
    >>> checked(jump)(height=2.0)
    2.0
    >>> checked(jump)(height=float("nan"))
    Traceback (most recent call last):
    ikns.errors.InvalidInput: expected a finite number for --height, found nan.
    """
    parameters = signature(command, eval_str=True).parameters

    @wraps(command)
    def run(**values: Any) -> None:
        for name, value in values.items():
            parameter = parameters[name]
            option = f"--{name.rstrip('_').replace('_', '-')}"
            if _is_argument(parameter):
                option = name.upper()
            for each in value if isinstance(value, (list, tuple)) else [value]:
                if parameter.default is Parameter.empty or each != parameter.default:
                    _check(option, each)
        command(**values)

    return run


def _is_argument(parameter: Parameter) -> bool:
    """Whether typer takes a parameter by its place."""
    about = getattr(parameter.annotation, "__metadata__", ())
    return any(isinstance(each, ArgumentInfo) for each in about)


def _check(option: str, value: Any) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidInput(f"expected a finite number for {option}, found {value:g}.")
    if isinstance(value, float) and option in _POSITIVE and value <= 0:
        raise InvalidInput(f"{option} must be above 0, found {value:g}.")
    if isinstance(value, (str, Path)):
        text = str(value)
        try:
            text.encode()
        except UnicodeEncodeError:
            shown = text.encode("utf-8", "backslashreplace").decode()
            raise InvalidInput(
                f"expected text in UTF-8 for {option}, found {shown}."
            ) from None
