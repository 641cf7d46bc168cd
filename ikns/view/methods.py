"""The methods side by side: what c does with a reach, a turned hand, a held hand."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.view.arrays import same_length, series
from ikns.view.style import GREY, MARKS, figure_style, new_figure, outside_legend


def methods_figure(
    reach_time: ArrayLike,
    reach: Mapping[str, ArrayLike],
    turn: ArrayLike,
    turned: Mapping[str, ArrayLike],
    swivel: ArrayLike,
    held: Mapping[str, ArrayLike],
    *,
    simulated: bool,
) -> Figure:
    """Draw c of every method in three panels with one axis of c.

    Parameters
    ----------
    reach_time : (T,) array
        s.
    reach : dict
        Method to c (T,) during a reach; its start is drawn at 0.
    turn : (N,) array
        Turn of the forearm, rad.
    turned : dict
        Method to c (N,); drawn from its middle.
    swivel : (S,) array
        Swivel of the elbow at one held hand, rad.
    held : dict
        Method to c (S,), as it is.
    """
    time, angle = series(reach_time, "reach_time"), series(turn, "turn")
    elbow = series(swivel, "swivel")
    with figure_style():
        figure = new_figure("c of each method", simulated=simulated, height=3.2)
        panels = figure.subplots(1, 3, sharey=True)
        titles = ("a natural reach", "a turned hand", "an elbow that is lifted")
        for axes, title in zip(panels, titles, strict=True):
            axes.axhspan(0, 1, color="#F4F4F4", lw=0)
            axes.set_title(title)
        for (method, values), (color, mark) in zip(reach.items(), MARKS, strict=False):
            c = series(values, f"reach of {method}")
            same_length(reach_time=time, reach=c)
            panels[0].plot(time, c - c[np.isfinite(c)][:1], color=color, label=method)
            c = series(turned[method], f"turned of {method}")
            same_length(turn=angle, turned=c)
            panels[1].plot(np.rad2deg(angle), c - c[len(c) // 2], color=color)
            c = series(held[method], f"held of {method}")
            same_length(swivel=elbow, held=c)
            panels[2].plot(
                np.rad2deg(elbow), c, mark, color=color, ms=2, mew=0, alpha=0.5
            )
        for axes in panels:
            axes.axhline(0, color=GREY, lw=0.7)
        panels[0].set_xlabel("time (s)")
        panels[0].set_ylabel("change of c (no unit); right: c")
        panels[1].set_xlabel("turn of the forearm (deg)")
        panels[2].set_xlabel("true elbow swivel (deg)")
        outside_legend(figure, *panels)
    return figure
