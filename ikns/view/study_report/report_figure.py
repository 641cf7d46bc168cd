"""A figure of a study's report, with its caption and the name of its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from ikns.statistics import Equivalence
from ikns.view.parts import Picture
from ikns.view.study_report.effect_figure import effect_figure

__all__ = ["ReportFigure", "difference_figures", "difference_name"]


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
            effect_figure(
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
