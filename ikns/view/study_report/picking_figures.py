"""Success and time by object: figures of experiment 2."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ikns.experiments.study.summary import PickingSummary
from ikns.view.study_report.comparisons import (
    condition_styles,
    scatter_places,
    study_figure,
)
from ikns.view.style import GREY, INK, PALE, figure_style, outside_legend

_APART = 0.36


def picking_figure(found: PickingSummary) -> Figure:
    """Share of success with intervals, and every trial's time, by object."""
    style, trials = condition_styles(found.conditions), found.trials()
    objects = [*found.objects, ""]
    places = np.arange(len(objects), dtype=float)
    places[-1] += 0.4  # all of them, a little apart
    offsets = _APART * (
        np.arange(len(found.conditions)) - (len(found.conditions) - 1) / 2
    )
    cells = {(cell.condition, cell.object): cell for cell in found.cells}
    with figure_style():
        figure = study_figure(
            "Success and time by object", simulated=found.simulated, height=5.2
        )
        upper, lower = figure.subplots(2, 1, sharex=True)
        for condition, offset in zip(found.conditions, offsets, strict=True):
            color, mark = style[condition]
            for place, name in zip(places, objects, strict=True):
                cell = cells[condition, name]
                if not cell.trials:
                    continue
                share = 100 * cell.succeeded / cell.trials
                ends = [[share - 100 * cell.low], [100 * cell.high - share]]
                upper.errorbar(
                    place + offset,
                    share,
                    ends if cell.subjects > 1 else None,
                    fmt=mark,
                    color=color,
                    ms=4.5,
                    capsize=2,
                    lw=0.9,
                    label=condition,
                )
                lower.plot(
                    [place + offset - 0.15, place + offset + 0.15],
                    [cell.restricted] * 2,
                    color=INK,
                    lw=1.6,
                    zorder=4,
                )
                if not name:
                    continue
                rows = (trials["condition"] == condition) & (trials["object"] == name)
                good = trials["success"][rows]
                time = np.where(good, trials["time"][rows], trials["limit"][rows])
                x = place + offset + scatter_places(len(time), width=0.26)
                dot = {"color": color, "ms": 3.2, "alpha": 0.75}
                lower.plot(x[good], time[good], mark, mew=0, **dot)
                lower.plot(x[~good], time[~good], "x", mew=1.0, **dot)
        upper.set_ylabel("trials that succeeded (%)")
        upper.set_ylim(-4, 104)
        lower.set_ylabel("time (s)")
        lower.set_ylim(bottom=0)
        lower.set_xlabel("object")
        lower.set_xticks(places, [name or "all" for name in objects])
        if np.isfinite(found.limit):
            lower.axhline(found.limit, color=GREY, lw=0.8, ls="--")
        for axes in (upper, lower):
            axes.yaxis.grid(visible=True, color=PALE)
        outside_legend(figure, upper)
    return figure
