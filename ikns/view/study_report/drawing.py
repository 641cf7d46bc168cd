"""Shared parts of the figures of a study: styles of conditions, legend, titles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ikns.view.style import INK, MARKS, new_figure

__all__ = [
    "condition_styles",
    "scatter_places",
    "study_figure",
]


_STYLES = (*MARKS, (INK, "v"))


def condition_styles(conditions: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return color and mark of every condition, the same in all figures of a report."""
    return {name: _STYLES[k % len(_STYLES)] for k, name in enumerate(conditions)}


def study_figure(title: str, *, simulated: bool, height: float) -> Figure:
    """Return an empty figure; its title says whether participants are simulated."""
    text = f"{title} (simulated participants)" if simulated else title
    return new_figure(text, simulated=False, height=height)


def scatter_places(count: int, *, width: float) -> np.ndarray:
    """Return offsets of dots around 0, so that few hide one another."""
    if count < 2:
        return np.zeros(count)
    # Steps of the golden ratio: neighbors in order are far apart for any count.
    turns = np.arange(count) * 0.6180339887498949 % 1.0
    return np.asarray(width * (turns - 0.5))
