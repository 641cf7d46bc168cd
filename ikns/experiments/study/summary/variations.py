"""Variations of a study against the study as planned, paired over participants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.experiments.study.summary.cells import Columns, Mean, mean_of, subject_means

__all__ = ["Varied", "variations"]


@dataclass(frozen=True)
class Varied:
    """A variation in one condition.

    Parameters
    ----------
    name : str
        Empty for the study as planned.
    settings : dict
        What it changes.
    condition : str
    over : Mean
        Of the subjects' means.
    against : Mean or None
        Of the same subjects' differences from the first variation; None for itself.
    """

    name: str
    settings: dict[str, Any]
    condition: str
    over: Mean
    against: Mean | None


def variations(
    table: Columns,
    value: str,
    *,
    planned: Mapping[str, Mapping[str, Any]],
    conditions: Sequence[str],
) -> list[Varied]:
    """Compare every variation with the first, condition by condition.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``variation``, ``condition`` and the value; a row is a trial.
    value : str
        Column.
    planned : mapping of str to mapping
        Settings by variation, the one to compare with first.
    conditions : sequence of str

    Returns
    -------
    list of Varied
        Empty with one variation only.
    """
    if len(planned) < 2:
        return []
    found = []
    for condition in conditions:
        own = table["condition"] == condition
        means = {
            name: subject_means(table, value, own & (table["variation"] == name))
            for name in planned
        }
        first = next(iter(planned))
        for name, settings in planned.items():
            here, base = means[name], means[first]
            shared = [who for who in here if who in base]
            against = np.array([here[who] - base[who] for who in shared])
            found.append(
                Varied(
                    name,
                    dict(settings),
                    condition,
                    mean_of(np.array(list(here.values()))),
                    None if name == first else mean_of(against),
                )
            )
    return found
