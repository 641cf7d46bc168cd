"""Values of a source, which are shown only as long as they are recent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: What was measured longer ago than this is unknown, s. Without poses for as long the
#: finger goes to its safe state.
_KNOWN_FOR = 0.5


def recent_values(*groups: tuple[Mapping[str, Any], float]) -> dict[str, Any]:
    """Return values with their age; those that are too old as None.

    Parameters
    ----------
    *groups : tuple of mapping and float
        Values by name, and how long ago they were measured, s; NaN for never.

    Returns
    -------
    dict
        All values, ``age`` of each by name, s, and ``unknown``, the names of those
        that were measured more than 0.5 s ago.

    Examples
    --------
    >>> recent_values(({"rate": 100.0}, 0.01), ({"residual": 0.002}, 3.0))["unknown"]
    ['residual']
    """
    values: dict[str, Any] = {}
    ages: dict[str, float] = {}
    for group, age in groups:
        values |= group
        ages |= dict.fromkeys(group, age)
    unknown = [name for name, age in ages.items() if not age <= _KNOWN_FOR]
    return values | dict.fromkeys(unknown) | {"age": ages, "unknown": unknown}
