"""Distance between the markers of the model and those that were seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.arrays import same_length, series
from ikns.view.style import BLUE, GREY, PALE, RED, figure_style, new_figure

__all__ = ["residual_figure"]


def residual_figure(
    time: ArrayLike,
    residual: ArrayLike,
    *,
    simulated: bool,
    marker_rms: ArrayLike | None = None,
    marker_labels: Sequence[str] = (),
    segments: Sequence[str] = (),
) -> Figure:
    """Draw the distance between seen and modeled markers, over time and by marker.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    residual : (T,) array
        Root mean square over the markers of a frame, m; NaN breaks the line.
    simulated : bool
    marker_rms : (M,) array, optional
        Root mean square over time of each marker, m; NaN where never seen.
    marker_labels, segments : sequences of M str
        Each marker's name and the segment that carries it.
    """
    t, distance = series(time, "time"), series(residual, "residual")
    same_length(time=t, residual=distance)
    rms = None if marker_rms is None else series(marker_rms, "marker_rms")
    if rms is not None and not len(rms) == len(marker_labels) == len(segments):
        raise InvalidInput(
            f"{len(rms)} marker_rms need as many marker_labels and segments, "
            f"found {len(marker_labels)} and {len(segments)}."
        )
    tall = 0 if rms is None else 0.14 * len(rms)
    with figure_style():
        figure = new_figure(
            "Distance between seen and modeled markers",
            simulated=simulated,
            height=max(3.2, 1.1 + tall),
        )
        over_time: Any = figure.add_subplot(1, 1 if rms is None else 2, 1)
        over_time.plot(t, 1e3 * distance, color=BLUE, lw=0.8)
        if np.isfinite(distance).any():
            median = 1e3 * float(np.nanmedian(distance))
            name = f"median {median:.1f} mm"
            over_time.axhline(median, color=RED, lw=1, ls="--", label=name)
            over_time.legend(loc="lower right", bbox_to_anchor=(1, 0.99))
        over_time.set_ylim(bottom=0)
        over_time.grid(axis="y")
        if len(t) > 1:
            over_time.set_xlim(t[0], t[-1])
        over_time.set_xlabel("time (s)")
        over_time.set_ylabel("root mean square over markers (mm)")
        if rms is not None:
            by_marker: Any = figure.add_subplot(1, 2, 2)
            _marker_dots(by_marker, rms, marker_labels, segments)
    return figure


def _marker_dots(
    axes: Any, rms: Array, labels: Sequence[str], segments: Sequence[str]
) -> None:
    order = sorted(range(len(rms)), key=lambda k: list(segments).index(segments[k]))
    groups = list(dict.fromkeys(segments[k] for k in order))
    for row, k in enumerate(order):
        axes.hlines(row, 0, 1e3 * rms[k], color=PALE, lw=1.5, zorder=1)
        axes.plot(1e3 * rms[k], row, "o", color=BLUE, ms=5, mew=0)
    for group in groups:
        rows = [row for row, k in enumerate(order) if segments[k] == group]
        axes.text(
            1.0,
            float(np.mean(rows)),
            group.replace("_", " "),
            transform=axes.get_yaxis_transform(),
            ha="right",
            va="center",
            fontsize=7.5,
            color=GREY,
        )
        if rows[0]:
            axes.axhline(rows[0] - 0.5, color=PALE, lw=0.7)
    axes.set_yticks(range(len(order)), [labels[k] for k in order])
    axes.set_ylim(len(order) - 0.4, -0.6)
    # Room on the right for the names of the segments.
    axes.set_xlim(0, 1.35 * max(1e-3, 1e3 * float(np.nanmax(rms, initial=0))))
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("root mean square over time (mm)")
