"""Tables of trials: which rows, which conditions, and who can be compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A table of trials: arrays of one length by name.
Columns = Mapping[str, NDArray[Any]]


def select(table: Columns, rows: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Return some rows of a table."""
    return {name: values[rows] for name, values in table.items()}


def rows_of(table: Columns, *, kind: str, variation: str) -> dict[str, NDArray[Any]]:
    """Return the rows of one kind (trial or training) in one variation."""
    return select(table, (table["kind"] == kind) & (table["variation"] == variation))


def ordered(found: Iterable[str], first: Sequence[str]) -> list[str]:
    """Return each word once: those listed first in that order, then the others.

    >>> ordered(["gamepad", "ikns", "mouse", "ikns"], ["ikns", "ring", "ikns"])
    ['ikns', 'gamepad', 'mouse']
    """
    once = list(dict.fromkeys(found))
    known = [word for word in dict.fromkeys(first) if word in once]
    return known + [word for word in once if word not in known]


def study_conditions(
    table: Columns, attempted: Iterable[str], plan: Mapping[str, Any]
) -> list[str]:
    """Return all conditions: ikns first, then as planned, then the others.

    Parameters
    ----------
    table : mapping of columns
    attempted : iterable of str
        Conditions with an attempt, measured or not.
    plan : mapping
        Table of the experiment in the study file; empty without one.
    """
    planned = [str(name) for name in plan.get("conditions", ())]
    found = [*planned, *table["condition"].tolist(), *attempted]
    return ordered(found, ["ikns", *planned])


def paired_subjects(trials: Columns, names: tuple[str, str]) -> tuple[int, str]:
    """Count the subjects with trials in both of two conditions.

    Returns
    -------
    subjects : int
    reason : str
        Why the conditions cannot be compared; empty if they can.
    """
    who = [set(trials["subject"][trials["condition"] == c].tolist()) for c in names]
    both = len(who[0] & who[1])
    if not any(who):
        return both, "Not tested: no trial was finished."
    for name, subjects in zip(names, who, strict=True):
        if not subjects:
            return both, f"Not tested: no trial of condition {name} was finished."
    if both == 1:
        return both, "Not tested: one participant only."
    if not both:
        reason = f"Not tested: no participant did both {names[0]} and {names[1]}."
        return both, reason
    return both, ""
