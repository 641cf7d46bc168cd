"""Draws a person's parameters from a table with the mean and spread of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["draw_parameters"]


def draw_parameters(
    table: Mapping[str, Mapping[str, Any]], rng: np.random.Generator
) -> dict[str, float]:
    """Draw each parameter from its distribution, clipped to its limits.

    Parameters
    ----------
    table : mapping of str to mapping
        For each parameter ``mean``, ``sd``, ``low`` and ``high`` of a normal
        distribution; with ``log`` true, ``mean`` is the median of a log-normal one and
        ``sd`` that of the logarithm.
    rng : numpy.random.Generator
        Source of randomness; one normal number is drawn for each parameter.

    Examples
    --------
    >>> table = {"delay": {"mean": 0.2, "sd": 0.0, "low": 0.1, "high": 0.3}}
    >>> draw_parameters(table, np.random.default_rng(0))
    {'delay': 0.2}
    """
    drawn = {}
    normal = rng.normal(size=len(table))
    for (name, row), z in zip(table.items(), normal, strict=True):
        if row.get("log"):
            value = row["mean"] * math.exp(row["sd"] * z)
        else:
            value = row["mean"] + row["sd"] * z
        drawn[name] = float(min(max(value, row["low"]), row["high"]))
    return drawn
