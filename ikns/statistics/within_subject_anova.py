"""Repeated-measures analysis of variance: condition, level, and both, by statsmodels.

The alternative to the mixed model for balanced data: each effect is tested against its
variation between subjects, without iteration, and no trial may be missing. Its test of
the condition is the paired t-test of subject means, squared.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass

import numpy as np

from ikns.errors import NotEnoughData
from ikns.output.wording import number, p_text
from ikns.statistics.library import statsmodels
from ikns.statistics.pairs import Pairs


@dataclass(frozen=True)
class VarianceTable:
    """(name, F, (degrees, error degrees), p) of condition, level, and both together."""

    effects: tuple[tuple[str, float, tuple[int, int], float], ...]
    subjects: int
    quantity: str

    def sentence(self) -> str:
        """Return the result as a sentence."""
        parts = [
            f"{name} {'has' if p < 0.05 else 'is not shown to have'} an effect (F({k}, "
            f"{m}) = {number(F)}, {p_text(p)})"
            for name, F, (k, m), p in self.effects
        ]
        return (
            f"Within-subject analysis of variance of {self.quantity} over "
            f"{self.subjects} subjects: {'; '.join(parts)}."
        )


def within_subject_anova(pairs: Pairs) -> VarianceTable:
    """Test condition, level and their interaction on pairs of every subject and level.

    Sphericity is assumed for effects with more than one degree of freedom.

    Raises
    ------
    NotEnoughData
        With fewer than 2 subjects or levels, or a subject without a level.
    """
    n, people = len(pairs.first), np.unique(pairs.subjects)
    places = np.unique(pairs.levels)
    cells = set(zip(pairs.subjects.tolist(), pairs.levels.tolist(), strict=True))
    if min(len(people), len(places)) < 2 or not (
        len(cells) == n == len(people) * len(places)
    ):
        raise NotEnoughData(
            "expected one pair of each of at least 2 subjects at each of at least 2 "
            f"levels, found {n} of {len(people)} subjects and {len(places)} levels."
        )
    pairs.need_spread()
    library = statsmodels("stats.anova")  # brings pandas, which its test reads from
    frame = importlib.import_module("pandas").DataFrame(
        {
            "value": np.concatenate([pairs.first, pairs.second]),
            "subject": np.tile(pairs.subjects, 2).tolist(),
            "level": np.tile(pairs.levels, 2).tolist(),
            "condition": ["first"] * n + ["second"] * n,
        }
    )
    fit = library.AnovaRM(frame, "value", "subject", within=["condition", "level"])
    rows = fit.fit().anova_table
    names = {"condition:level": "condition x level"}
    effects = tuple(
        (
            names.get(str(name), str(name)),
            float(row["F Value"]),
            (int(row["Num DF"]), int(row["Den DF"])),
            float(row["Pr > F"]),
        )
        for name, row in rows.iterrows()
    )
    return VarianceTable(effects, len(people), pairs.quantity)
