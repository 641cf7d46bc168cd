"""Tests and effect sizes as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ikns.statistics import Effect
from ikns.view.parts import Cell, Table

__all__ = ["effects_table", "tests_table"]


def tests_table(paper: Sequence[Any], others: Sequence[tuple[str, Any]]) -> Table:
    """Return the sentences of all tests that there are, the paper's first, by name."""
    rows: list[list[Cell]] = [
        ["the paper's own", each.sentence()] for each in paper if each is not None
    ]
    rows += [[name, each.sentence()] for name, each in others if each is not None]
    return Table(["test", "what it says"], rows, "Tests, each with its n.")


def effects_table(effects: Sequence[Effect]) -> Table:
    """Return effect sizes with intervals."""
    return Table(
        ["effect", "unit", "value", "95 % from", "to", "n participants", "interval by"],
        [
            [
                each.name,
                each.unit or "SD",
                each.value,
                _finite(each.low),
                _finite(each.high),
                each.subjects,
                each.method,
            ]
            for each in effects
        ],
        "Effect sizes over participants' means; a dash where so few allow no interval.",
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
