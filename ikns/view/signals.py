"""The control signal against the true swivel, and over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.view.arrays import same_length, series
from ikns.view.style import (
    BLUE,
    GREY,
    INK,
    figure_style,
    new_figure,
    outside_legend,
    point_color,
)

_COLUMNS = 5
#: Widest axis of c: outside the volume c has no bound.
_FARTHEST_C = (-1.5, 2.5)


def swivel_figure(
    swivel: ArrayLike,
    control_signal: ArrayLike,
    labels: ArrayLike,
    correlations: ArrayLike,
    *,
    simulated: bool,
) -> Figure:
    """Draw c against the elbow's true swivel, one panel per PCA point.

    Parameters
    ----------
    swivel : (N,) array
        True swivel angle, rad.
    control_signal : (N,) array
        Unclipped c.
    labels : (N,) integer array
        PCA point of each sample; negative ones are left out.
    correlations : (P,) array
        Correlation r of the two at each point, for the titles.
    """
    angle, signal = series(swivel, "swivel"), series(control_signal, "control_signal")
    point = np.asarray(labels)
    same_length(swivel=angle, control_signal=signal, labels=point)
    r = series(correlations, "correlations")
    columns = min(_COLUMNS, max(1, len(r)))
    rows = max(1, -(-len(r) // columns))
    with figure_style():
        figure = new_figure(
            "Control signal against the true elbow swivel",
            simulated=simulated,
            height=1.0 + 1.55 * rows,
            width=max(7.5, 1.8 * columns),
        )
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for k, axes in enumerate(grid.flat):
            if k >= len(r):
                axes.set_axis_off()
                continue
            at = point == k
            axes.axhspan(0, 1, color="#F4F4F4", lw=0)
            axes.plot(
                np.rad2deg(angle[at]),
                signal[at],
                ".",
                color=BLUE,
                ms=2.5,
                mew=0,
                alpha=0.6,
            )
            known = f"r = {r[k]:+.3f}" if np.isfinite(r[k]) else "r unknown"
            axes.set_title(f"point {k + 1}:  {known}")
            axes.set_yticks([0, 1])
        figure.supxlabel(
            "true elbow swivel (deg), positive: elbow lifted", fontsize=8.5
        )
        figure.supylabel("control signal c (no unit)", fontsize=8.5)
    return figure


def control_figure(
    time: ArrayLike,
    control_signal: ArrayLike,
    hand_speed: ArrayLike,
    inside: ArrayLike,
    *,
    simulated: bool,
    gate: float | None = None,
    taught: str = "in the volume",
) -> Figure:
    """Draw c and hand speed over time, shaded where the hand is not as taught.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    control_signal : (T,) or (T, d) array
        c, clipped or not; NaN breaks the line.
    hand_speed : (T,) array
        m/s in the thorax frame.
    inside : (T,) boolean array
        Whether the hand was inside the interpolation volume.
    gate : float, optional
        Hand speed below which samples were learned from, m/s; drawn as a line.
    taught : str
        Where the hand is while `inside` holds.
    """
    t, speed = series(time, "time"), series(hand_speed, "hand_speed")
    signal = np.asarray(control_signal, dtype=np.float64)
    signals = signal[:, None] if signal.ndim == 1 else signal
    within = np.asarray(inside, dtype=bool)
    same_length(time=t, control_signal=signals, hand_speed=speed, inside=within)
    with figure_style():
        figure = new_figure("Control signal over time", simulated=simulated, height=3.9)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, 1])
        for axes in (upper, lower):
            _shade(axes, t, ~within, f"hand not {taught}")
        for level in (0, 1):
            upper.axhline(level, color=GREY, lw=0.7)
        for k, column in enumerate(signals.T):
            name = "c" if signals.shape[1] == 1 else f"c{k + 1}"
            upper.plot(t, column, color=point_color(k), label=name)
        _bound_c(upper, signals)
        upper.set_ylabel("control signal c (no unit)")
        lower.plot(t, speed, color=INK, label="hand speed")
        if gate is not None:
            lower.axhline(gate, color=INK, lw=0.8, ls="--", label="gate")
        lower.set_ylim(bottom=0)
        lower.set_ylabel("hand speed (m/s)")
        lower.set_xlabel("time (s)")
        if len(t) > 1:
            lower.set_xlim(t[0], t[-1])
        figure.align_ylabels()
        outside_legend(figure, upper, lower)
    return figure


def _shade(axes: Any, time: Array, where: Mask, label: str) -> None:
    """Shade the time intervals in which `where` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where.astype(int), [0]])))
    if not edges.size:
        return
    start, stop = time[np.minimum(edges, len(time) - 1).reshape(-1, 2)].T
    # One artist for all: a trembling hand at the border makes thousands of intervals.
    axes.broken_barh(
        np.stack([start, stop - start], axis=1),
        (0, 1),
        transform=axes.get_xaxis_transform(),
        color="#E3E3E3",
        lw=0,
        label=label,
    )


def _bound_c(axes: Any, signals: Array) -> None:
    """Limit the axis of c and say how many values lie beyond it."""
    finite = signals[np.isfinite(signals)]
    low = max(_FARTHEST_C[0], float(np.min(finite, initial=0.0)) - 0.1)
    high = min(_FARTHEST_C[1], float(np.max(finite, initial=1.0)) + 0.1)
    axes.set_ylim(low, high)
    beyond = int(((finite < low) | (finite > high)).sum())
    if beyond:
        axes.text(
            1.0,
            1.02,
            f"{beyond} of {finite.size} values lie beyond this axis",
            transform=axes.transAxes,
            ha="right",
            fontsize=7.5,
            color=GREY,
        )
