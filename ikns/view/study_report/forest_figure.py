"""The answers as one figure: differences with their intervals against the margins."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from ikns.experiments.study.summary import Group
from ikns.output.wording import number
from ikns.statistics import Equivalence, PairedT
from ikns.view.study_report.comparisons import (
    NO_INTERVAL,
    ReportFigure,
    study_figure,
)
from ikns.view.style import BLUE, GREEN, GREY, INK, PALE, figure_style

#: Inches of a row, and of a panel's axis and margins.
_ROW, _PANEL = 0.75, 0.75
#: Inches: what a phone shows without scrolling.
_WIDTH = 4.2


class _Row(NamedTuple):
    names: tuple[str, str]
    test: PairedT | None  # None with one participant
    same: Equivalence | None


def forest_figure(group: Group) -> ReportFigure | None:
    """Draw the mean difference of every comparison; None where there is none.

    One panel for each experiment, as their units differ. Thin: the 95 % interval, which
    tells a difference where it leaves 0 out. Thick: the 90 % interval, which tells
    equivalence where all of it lies within the margin.
    """
    panels = [
        ("Tracking: RMSE", list(_tracking(group))),
        ("Pick and place: time to success", list(_picking(group))),
    ]
    panels = [(title, rows) for title, rows in panels if any(row.test for row in rows)]
    if not panels:
        return None
    sizes = [_PANEL + _ROW * len(rows) for _, rows in panels]
    with figure_style():
        figure = study_figure(
            "Differences",
            simulated=group.simulated,
            height=0.4 + sum(sizes),
            width=_WIDTH,
        )
        places = figure.subplots(
            len(panels), 1, squeeze=False, height_ratios=sizes
        ).ravel()
        for axes, (title, rows) in zip(places, panels, strict=True):
            _draw(axes, title, rows)
    return ReportFigure(
        "answers",
        figure,
        "Mean difference over participants with its 95 % interval (thin) and, where a "
        "margin was declared beforehand (green), its 90 % interval (thick). A "
        "difference is shown where the thin line leaves 0 out; equivalence where the "
        "whole thick line lies in the green.",
        "Differences between conditions with their intervals and margins",
    )


def _tracking(group: Group) -> Iterator[_Row]:
    for each in () if group.tracking is None else group.tracking.comparisons:
        if each.analysis is not None:
            yield _Row(each.names, each.analysis.subjects, each.analysis.equivalence)
        elif each.subjects == 1:
            yield _Row(each.names, None, None)


def _picking(group: Group) -> Iterator[_Row]:
    for each in () if group.picking is None else group.picking.comparisons:
        test = None if each.analysis is None else each.analysis.time.over_subjects
        if test is not None or each.subjects == 1:
            yield _Row(each.names, test, each.equivalence)


def _draw(axes: Any, title: str, rows: list[_Row]) -> None:
    axes.axvline(0, color=GREY, lw=0.8)
    tests = [row.test for row in rows if row.test is not None]
    margins = {row.same.margin for row in rows if row.same is not None}
    for margin in margins:
        axes.axvspan(-margin, margin, facecolor=GREEN, alpha=0.13, lw=0)
    for place, row in enumerate(reversed(rows)):
        test, same = row.test, row.same
        said = "{} minus {}".format(*row.names)
        if same is not None:
            said += f": {same.verdict}"
        if test is None:
            said += f"\n{NO_INTERVAL}"
        else:
            axes.plot([test.low, test.high], [place, place], color=INK, lw=1.2)
            said += f"\n{test.difference:+.2f} ({test.low:+.2f} to {test.high:+.2f})"
        if same is not None:
            axes.plot([same.low, same.high], [place, place], color=BLUE, lw=4)
        if test is not None:
            axes.plot(test.difference, place, "o", color=INK, ms=6)
        axes.annotate(
            said, (0.01, place + 0.35), xycoords=("axes fraction", "data"), va="center"
        )
    # The axis is that of what has an interval.
    far = 1.15 * max(
        *margins, *(abs(end) for test in tests for end in (test.low, test.high))
    )
    axes.set_xlim(-far, far)
    axes.set_ylim(-0.3, len(rows) - 0.3)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.xaxis.grid(visible=True, color=PALE)
    unit = tests[0].unit
    declared = ", ".join(number(margin, unit) for margin in sorted(margins))
    axes.set_title(f"{title}; margin {declared}" if margins else title)
    axes.set_xlabel(f"difference ({unit}), 95 % interval")
