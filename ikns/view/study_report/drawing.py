"""Shared parts of the figures of a study: styles of conditions, legend, titles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ikns.view.style import INK, MARKS, new_figure

__all__ = [
    "ConditionStyle",
    "condition_styles",
    "outside_legend",
    "scatter_places",
    "study_figure",
]


class ConditionStyle(NamedTuple):
    """Color and mark of a condition; marks differ too."""

    color: str
    mark: str


_STYLES = (
    *(ConditionStyle(color, mark) for color, mark in MARKS),
    ConditionStyle(INK, "v"),
)


def condition_styles(conditions: Sequence[str]) -> dict[str, ConditionStyle]:
    """Return the style of every condition, the same in all figures of a report."""
    return {name: _STYLES[k % len(_STYLES)] for k, name in enumerate(conditions)}


def study_figure(
    title: str, *, simulated: bool, height: float, width: float = 9.0
) -> Figure:
    """Return an empty figure; its title says whether participants are simulated."""
    text = f"{title} (simulated participants)" if simulated else title
    return new_figure(text, simulated=False, height=height, width=width)


def scatter_places(count: int, *, width: float) -> np.ndarray:
    """Return offsets of dots around 0, so that few hide one another."""
    if count < 2:
        return np.zeros(count)
    # Steps of the golden ratio: neighbors in order are far apart for any count.
    turns = np.arange(count) * 0.6180339887498949 % 1.0
    return np.asarray(width * (turns - 0.5))


def outside_legend(figure: Figure, axes: Any) -> None:
    """Add one legend for all panels, next to the title."""
    handles, names = axes.get_legend_handles_labels()
    named = dict(zip(names, handles, strict=True))
    if named:
        figure.legend(
            list(named.values()),
            list(named),
            loc="outside upper right",
            ncols=len(named),
        )
