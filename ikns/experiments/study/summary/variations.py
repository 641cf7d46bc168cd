"""Variations of a study against the study as planned, paired over participants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.experiments.study.summary.means import Mean, mean_of, subject_means
from ikns.experiments.study.summary.trials import Columns


@dataclass(frozen=True)
class VariationMean:
    """Mean of a variation in one condition, and its difference from the first one.

    Parameters
    ----------
    name : str
        Empty for the study as planned.
    settings : dict
        Parameters that it changes.
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


def compare_variations(
    table: Columns,
    value: str,
    *,
    planned: Mapping[str, Mapping[str, Any]],
    conditions: Sequence[str],
) -> list[VariationMean]:
    """Compare each variation with the first one, in each condition.

    Parameters
    ----------
    table : mapping of columns
        ``subject``, ``variation``, ``condition`` and the value; a row is a trial.
    value : str
        Column.
    planned : mapping of str to mapping
        Settings by variation, the first one being the reference.
    conditions : sequence of str

    Returns
    -------
    list of VariationMean
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
                VariationMean(
                    name,
                    dict(settings),
                    condition,
                    mean_of(np.array(list(here.values()))),
                    None if name == first else mean_of(against),
                )
            )
    return found
