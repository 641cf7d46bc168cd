"""Trials as a tidy table: one row per trial, one column per variable.

A table is a mapping from column names to sequences of one length, which is checked
here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData

Table = Mapping[str, Sequence[Any] | NDArray[Any]]


def column(table: Table, name: str) -> NDArray[Any]:
    """One column, checked to be there and as long as all others."""
    if name not in table:
        raise InvalidInput(
            f"expected a column {name!r}, found {', '.join(map(repr, table)) or 'none'}"
            "."
        )
    lengths = {key: len(table[key]) for key in table}
    if len(set(lengths.values())) > 1:
        raise InvalidInput(f"expected columns of one length, found {lengths}.")
    return np.asarray(table[name])


def numbers(values: Any, name: str) -> Array:
    """Convert to floating point; what is missing becomes NaN."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        first = np.ravel(np.asarray(values, dtype=object))[0]
        raise InvalidInput(
            f"expected numbers as {name}, found {str(first)!r} or the like."
        ) from None


def finite_values(values: Any, name: str) -> Array:
    """Numbers of one axis, none missing."""
    array = numbers(values, name)
    if array.ndim != 1:
        raise InvalidInput(
            f"expected one axis of {name}, found an array of shape {array.shape}."
        )
    bad = np.flatnonzero(~np.isfinite(array))
    if len(bad):
        raise InvalidInput(
            f"expected finite {name}, found {array[bad[0]]} in row {bad[0]}, the first "
            f"of {len(bad)}."
        )
    return array


def labels(table: Table, name: str) -> NDArray[np.str_]:
    """One column as text."""
    return np.asarray([str(item) for item in column(table, name)], dtype=np.str_)


def two_conditions(
    table: Table, conditions: Sequence[str] | None
) -> tuple[NDArray[np.str_], tuple[str, str]]:
    """Column ``condition`` and the two names to compare, in order of the difference.

    Without names: the two that the table holds, in the order in which they appear.
    """
    found = labels(table, "condition")
    present = list(dict.fromkeys(found.tolist()))
    wanted = present if conditions is None else list(map(str, conditions))
    if len(wanted) != 2 or wanted[0] == wanted[1]:
        raise InvalidInput(f"expected two conditions to compare, found {wanted}.")
    for name in wanted:
        if name not in present:
            raise NotEnoughData(
                f"expected trials of condition {name!r}, found only {present}."
            )
    return found, (wanted[0], wanted[1])
