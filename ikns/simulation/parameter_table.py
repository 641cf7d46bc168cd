"""Draws a person's parameters from a table with the mean and spread of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def draw_parameters(
    table: Mapping[str, Mapping[str, Any]], rng: np.random.Generator
) -> dict[str, float]:
    """Draw each parameter from its distribution, clipped to its limits.

    A row has ``mean``, ``sd``, ``low`` and ``high`` of a normal distribution; with
    ``log`` true, ``mean`` is the median of a log-normal one and ``sd`` that of the
    logarithm. One normal number is drawn for each parameter.
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
