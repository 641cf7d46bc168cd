"""Paired values of two conditions, the input of the paired tests.

Every difference in this package is the first condition minus the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics.table import Table, column, finite_values, labels, two_conditions


@dataclass(frozen=True, eq=False)
class Pairs:
    """Values of two conditions, pair by pair.

    Parameters
    ----------
    first, second : (n,) array
        In ``unit``.
    subjects, levels : (n,) array of str
        Whose pair it is; its trajectory or object, empty text for means over them.
    names : (str, str)
        Of the conditions.
    dropped : int
        Pairs left out because one value is missing.
    """

    first: Array
    second: Array
    subjects: NDArray[np.str_]
    levels: NDArray[np.str_]
    names: tuple[str, str] = ("first", "second")
    quantity: str = "value"
    unit: str = ""
    dropped: int = 0

    @property
    def differences(self) -> Array:
        """First minus second, (n,), in ``unit``."""
        return self.first - self.second

    @property
    def subject_count(self) -> int:
        """How many persons the pairs come from."""
        return len(np.unique(self.subjects))

    def subject_means(self) -> Pairs:
        """Each person's mean over all pairs: one pair a person."""
        people = np.unique(self.subjects)
        if len(people) < 2:
            raise NotEnoughData(f"expected at least 2 subjects, found {len(people)}.")
        rows = [self.subjects == person for person in people]
        return replace(
            self,
            first=np.array([self.first[row].mean() for row in rows]),
            second=np.array([self.second[row].mean() for row in rows]),
            subjects=people,
            levels=np.full(len(people), "", dtype=np.str_),
        )

    def need_spread(self, at_least: int = 2) -> Array:
        """Differences, checked to be enough and not all the same."""
        d = self.differences
        if len(d) < at_least:
            raise NotEnoughData(f"expected at least {at_least} pairs, found {len(d)}.")
        # Equal differences leave rounding of the values behind, no more.
        scale = max(np.abs(self.first).max(), np.abs(self.second).max())
        if np.ptp(d) <= 1e-12 * scale:
            raise NotEnoughData(
                f"expected differences that vary, found {len(d)} times {d[0]:g}."
            )
        return d


def pair_arrays(
    first: ArrayLike,
    second: ArrayLike,
    *,
    subjects: Sequence[Any] | None = None,
    levels: Sequence[Any] | None = None,
    names: tuple[str, str] = ("first", "second"),
    quantity: str = "value",
    unit: str = "",
) -> Pairs:
    """Pairs from two arrays; each pair is another person's unless ``subjects`` says so.

    Parameters
    ----------
    first, second : (n,) array
        Finite.
    subjects, levels : sequence of n, optional
    names, quantity, unit
        As in :class:`Pairs`.

    Raises
    ------
    InvalidInput
        For lengths that differ or values that are not finite.
    NotEnoughData
        With fewer than 2 pairs.

    Examples
    --------
    >>> pairs = pair_arrays([3.0, 5.0, 4.0], [2.0, 5.0, 1.0])
    >>> pairs.differences.tolist()
    [1.0, 0.0, 3.0]
    """
    a = finite_values(first, f"{quantity} of {names[0]}")
    b = finite_values(second, f"{quantity} of {names[1]}")
    if len(a) != len(b):
        raise InvalidInput(
            f"expected as many values of {names[0]} as of {names[1]}, found {len(a)} "
            f"and {len(b)}."
        )
    if len(a) < 2:
        raise NotEnoughData(f"expected at least 2 pairs, found {len(a)}.")
    who = list(range(len(a))) if subjects is None else list(subjects)
    where = [""] * len(a) if levels is None else list(levels)
    for name, items in (("subjects", who), ("levels", where)):
        if len(items) != len(a):
            raise InvalidInput(
                f"expected {len(a)} {name}, one a pair, found {len(items)}."
            )
    return Pairs(
        a,
        b,
        np.asarray([str(item) for item in who], dtype=np.str_),
        np.asarray([str(item) for item in where], dtype=np.str_),
        names,
        quantity,
        unit,
    )


def pair_trials(
    table: Table,
    value: str,
    *,
    level: str | None = "trajectory",
    conditions: Sequence[str] | None = None,
    unit: str = "",
    unequal: Literal["refuse", "keep"] = "refuse",
) -> Pairs:
    """Pairs from a table of trials: repeats are averaged per subject and level.

    Parameters
    ----------
    table : mapping of columns
        With ``subject``, ``condition``, the level and the value; a row is a trial.
    value : str
        Column to compare.
    level : str or None
        Column that splits a subject's trials into pairs; None: one pair a subject.
    conditions : (str, str), optional
        First and second of the difference; by default in order of appearance.
    unit : str
        Of the value.
    unequal : "refuse" or "keep"
        What to do when a subject has not as many trials in both conditions: refuse, or
        average what is there and count pairs without a partner as dropped.

    Examples
    --------
    >>> pairs = pair_trials(
    ...     {
    ...         "subject": ["a", "a", "a", "a", "b", "b"],
    ...         "condition": ["ring", "ring", "IKNS", "IKNS", "ring", "IKNS"],
    ...         "object": ["cup", "cup", "cup", "cup", "cup", "cup"],
    ...         "time": [5.0, 7.0, 8.0, 10.0, 5.0, 9.0],
    ...     },
    ...     "time",
    ...     level="object",
    ...     conditions=("IKNS", "ring"),
    ... )
    >>> pairs.differences.tolist()
    [3.0, 4.0]
    """
    found, names = two_conditions(table, conditions)
    values = np.asarray(column(table, value))
    used = np.isin(found, names)
    values = finite_values(values[used], value)
    who, condition = labels(table, "subject")[used], found[used]
    where = np.full(len(who), "") if level is None else labels(table, level)[used]
    means: tuple[list[float], list[float]] = ([], [])
    keys, dropped = [], 0
    for person, place in sorted(set(zip(who.tolist(), where.tolist(), strict=True))):
        here = (who == person) & (where == place)
        sides = [values[here & (condition == name)] for name in names]
        if len(sides[0]) != len(sides[1]) and unequal == "refuse":
            at = f" at {level} {place!r}" if level is not None else ""
            raise InvalidInput(
                f"expected as many trials of {names[0]} as of {names[1]}, found "
                f"{len(sides[0])} and {len(sides[1])} of subject {person!r}{at}."
            )
        if not (len(sides[0]) and len(sides[1])):
            dropped += 1
            continue
        keys.append((person, place))
        for side, mean in zip(sides, means, strict=True):
            mean.append(float(side.mean()))
    pairs = pair_arrays(
        *means,
        subjects=[key[0] for key in keys],
        levels=[key[1] for key in keys],
        names=names,
        quantity=value,
        unit=unit,
    )
    return replace(pairs, dropped=dropped)
