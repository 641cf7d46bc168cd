"""Tables of a study file as dataclasses; unknown keys and wrong types are errors."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar, get_type_hints

from ikns.errors import InvalidInput

T = TypeVar("T")

_WORDS = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    tuple[str, ...]: "a list of text",
}


def fill(kind: type[T], table: Any, where: str) -> T:
    """Make a dataclass from a table; missing keys get their defaults.

    Raises
    ------
    InvalidInput
        When a key is unknown or missing, or a value is of another type.
    """
    if not isinstance(table, Mapping):
        raise InvalidInput(f"expected a table [{where}], found {table!r}.")
    hints = get_type_hints(kind)
    own = fields(kind)  # type: ignore[arg-type]
    check_keys(table, [field.name for field in own], where)
    values = {}
    for field in own:
        if field.name in table:
            wanted = hints[field.name]
            values[field.name] = _value(table[field.name], wanted, where, field.name)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise InvalidInput(f"expected {field.name} in [{where}], found none.")
    return kind(**values)


def check_keys(table: Iterable[str], known: Iterable[str], where: str) -> None:
    """Raise if a key is unknown, and name the most similar known one."""
    names = list(known)
    for key in table:
        if key in names:
            continue
        near = difflib.get_close_matches(key, names, n=1, cutoff=0.5)
        right = f"'{near[0]}'" if near else f"one of {', '.join(names)}"
        place = f"[{where}]" if where else "a study file"
        raise InvalidInput(f"expected {right} in {place}, found '{key}'.")


def positive(where: str, **numbers: float) -> None:
    """Raise if a number is not above 0 and finite."""
    for name, value in numbers.items():
        if not 0 < value < math.inf:
            raise InvalidInput(
                f"expected {name} above 0 in [{where}], found {value:g}."
            )


def choice(where: str, key: str, found: str, known: Iterable[str]) -> None:
    """Raise if a word is none of the known ones."""
    names = list(known)
    if found not in names:
        raise InvalidInput(
            f"expected {key} of {', '.join(names)} in [{where}], found '{found}'."
        )


def _value(value: Any, wanted: Any, where: str, key: str) -> Any:
    if wanted == float | None:
        wanted = float
    if wanted is float and type(value) is int:
        value = float(value)
    if wanted == tuple[str, ...] and isinstance(value, list):
        if all(isinstance(item, str) for item in value):
            return tuple(value)
    elif type(value) is wanted:
        return value
    raise InvalidInput(
        f"expected {_WORDS[wanted]} for {key} in [{where}], found {value!r}."
    )
