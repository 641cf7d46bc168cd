"""Distance between the markers of the model and those that were seen."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.view.arrays import same_length, series
from ikns.view.style import BLUE, RED, figure_style, new_figure


def residual_figure(time: ArrayLike, residual: ArrayLike, *, simulated: bool) -> Figure:
    """Draw the distance between seen and modeled markers over time.

    At times (T,), s, the root mean square over the markers of a frame (T,), m; NaN
    breaks the line.
    """
    t, distance = series(time, "time"), series(residual, "residual")
    same_length(time=t, residual=distance)
    with figure_style():
        figure = new_figure(
            "Distance between seen and modeled markers",
            simulated=simulated,
            height=3.2,
        )
        axes = figure.add_subplot()
        axes.plot(t, 1e3 * distance, color=BLUE, lw=0.8)
        if np.isfinite(distance).any():
            median = 1e3 * float(np.nanmedian(distance))
            name = f"median {median:.1f} mm"
            axes.axhline(median, color=RED, lw=1, ls="--", label=name)
            axes.legend(loc="lower right", bbox_to_anchor=(1, 0.99))
        axes.set_ylim(bottom=0)
        axes.grid(axis="y")
        if len(t) > 1:
            axes.set_xlim(t[0], t[-1])
        axes.set_xlabel("time (s)")
        axes.set_ylabel("root mean square over markers (mm)")
    return figure
