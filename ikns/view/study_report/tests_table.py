"""Tests as a table: whose they are, what they say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from ikns.experiments.statistics import Effect
from ikns.view.parts import Cell, Table

__all__ = ["Says", "effects_table", "tests_table"]


class Says(Protocol):
    """A result of a test."""

    def sentence(self) -> str:
        """Say it."""


def tests_table(
    paper: Sequence[tuple[str, Says | None]],
    beside: Sequence[tuple[str, Says | None]],
) -> Table:
    """Sentences of all tests, the paper's first and labelled so."""
    rows: list[list[Cell]] = [
        ["the paper's own", each.sentence()] for _, each in paper if each is not None
    ]
    rows += [[name, each.sentence()] for name, each in beside if each is not None]
    return Table(["test", "what it says"], rows, "Tests, each with its n.")


def effects_table(effects: Sequence[Effect]) -> Table:
    """Effect sizes with intervals."""
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
