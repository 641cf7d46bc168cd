"""What the figures of a study share: a color and a mark for every condition."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ikns.view.style import BLUE, GREEN, INK, ORANGE, PURPLE, new_figure

__all__ = ["Look", "looks", "outside_legend", "scatter_places", "study_figure"]


class Look(NamedTuple):
    """How a condition is drawn; told apart by shape and lightness as well."""

    color: str
    mark: str


_LOOKS = (
    Look(BLUE, "o"),
    Look(ORANGE, "D"),
    Look(GREEN, "s"),
    Look(PURPLE, "^"),
    Look(INK, "v"),
)


def looks(conditions: Sequence[str]) -> dict[str, Look]:
    """Look of every condition, the same in all figures of a report."""
    return {name: _LOOKS[k % len(_LOOKS)] for k, name in enumerate(conditions)}


def study_figure(
    title: str, *, simulated: bool, height: float, width: float = 9.0
) -> Figure:
    """Return an empty figure that says in its title when nobody took part."""
    said = f"{title} (simulated participants)" if simulated else title
    return new_figure(said, simulated=False, height=height, width=width)


def scatter_places(count: int, *, width: float) -> np.ndarray:
    """Places of dots side by side around 0, so that few hide one another."""
    if count < 2:
        return np.zeros(count)
    # Golden steps: neighbors in order are far apart, whatever the count.
    turns = np.arange(count) * 0.6180339887498949 % 1.0
    return np.asarray(width * (turns - 0.5))


def outside_legend(figure: Figure, axes: Any) -> None:
    """One legend for all panels, beside the title."""
    handles, names = axes.get_legend_handles_labels()
    named = dict(zip(names, handles, strict=True))
    if named:
        figure.legend(
            list(named.values()),
            list(named),
            loc="outside upper right",
            ncols=len(named),
        )
