"""What both experiments share in a report: styles, differences, tests, effects."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ikns.statistics import Effect, Equivalence
from ikns.view.cells import Cell
from ikns.view.parts import Picture, Table
from ikns.view.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MARKS,
    PAGE_WIDTH,
    PALE,
    figure_style,
    new_figure,
)

NO_MARGIN = "No margin was declared beforehand, so equivalence was not tested."
NO_INTERVAL = "no interval for one participant"
NO_TRIAL = "No trial was finished, so there is nothing to draw or to test."
_BOX = {"facecolor": GREEN, "alpha": 0.13, "lw": 0}
_STYLES = (*MARKS, (INK, "v"))


def condition_styles(conditions: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return color and mark of every condition, the same in all figures of a report."""
    return {name: _STYLES[k % len(_STYLES)] for k, name in enumerate(conditions)}


def study_figure(
    title: str, *, simulated: bool, height: float, width: float = PAGE_WIDTH
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


class ReportFigure(NamedTuple):
    """A figure, the name of its file, its caption and its alternative text."""

    name: str
    figure: Figure
    caption: str
    alt: str

    @property
    def picture(self) -> Picture:
        """The figure as a part of the page."""
        return Picture(self.figure, self.caption, self.alt)


def difference_name(experiment: str, comparison: int) -> str:
    """Name of the file of a comparison's figure; comparisons count from 0.

    >>> difference_name("tracking", 0), difference_name("tracking", 1)
    ('tracking_difference', 'tracking_difference_2')
    """
    number = f"_{comparison + 1}" if comparison else ""
    return f"{experiment}_difference{number}"


def difference_figures(
    experiment: str,
    comparisons: Iterable[Any],
    *,
    equivalence: Callable[[Any], Equivalence | None],
    quantity: str,
    caption: str,
    simulated: bool,
) -> list[ReportFigure]:
    """Draw the difference of every comparison of an experiment that has effects.

    `equivalence` returns a comparison's test of equivalence, or None; the caption
    follows "A minus B".
    """
    return [
        ReportFigure(
            difference_name(experiment, k),
            _effect_figure(
                equivalence(each),
                each.analysis.effects,
                quantity=quantity,
                simulated=simulated,
            ),
            f"{each.names[0]} minus {each.names[1]}{caption}",
            "Intervals of the difference and of standardized effects",
        )
        for k, each in enumerate(comparisons)
        if each.analysis is not None and each.analysis.effects
    ]


def _effect_figure(
    same: Equivalence | None,
    effects: Sequence[Effect],
    *,
    quantity: str,
    simulated: bool,
) -> Figure:
    """Draw the 90 % interval against the margin, next to standardized effects.

    Without a declared margin the first panel is left out. Standardized effects are
    drawn with their 95 % intervals; the quantity is such as ``RMSE``.
    """
    shown = [effect for effect in effects if not effect.unit]
    with figure_style():
        figure = study_figure(
            f"Difference of {quantity}", simulated=simulated, height=2.3
        )
        panels = figure.subplots(1, 1 if same is None else 2, squeeze=False)[0]
        if same is not None:
            axes = panels[0]
            axes.axvspan(-same.margin, same.margin, label="margin", **_BOX)
            axes.axvline(0, color=GREY, lw=0.8)
            axes.plot([same.low, same.high], [0, 0], color=BLUE, lw=2.2)
            axes.plot(same.difference, 0, "o", color=BLUE, ms=6)
            far = 1.15 * max(same.margin, abs(same.low), abs(same.high))
            axes.set_xlim(-far, far)
            axes.set_ylim(-1, 1)
            axes.set_yticks([])
            axes.spines["left"].set_visible(False)
            axes.set_title(
                f"{100 * (1 - 2 * same.alpha):g} % interval against the margin of "
                f"{same.margin:g}: {same.verdict}"
            )
            axes.set_xlabel(
                f"{quantity}, {same.names[0]} minus {same.names[1]} ({same.unit})"
            )
        axes = panels[-1]
        axes.axvline(0, color=GREY, lw=0.8)
        for place, effect in enumerate(reversed(shown)):
            if np.isfinite([effect.low, effect.high]).all():
                axes.plot([effect.low, effect.high], [place, place], color=INK, lw=1.6)
            axes.plot(effect.value, place, "s", color=INK, ms=5)
        axes.set_yticks(range(len(shown)), [effect.name for effect in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.xaxis.grid(visible=True, color=PALE)
        n = shown[0].subjects if shown else 0
        axes.set_title(f"standardized effects, 95 % intervals (n = {n})")
        if shown:
            names = shown[0].names
            axes.set_xlabel(f"{names[0]} minus {names[1]} (standard deviations)")
    return figure


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
