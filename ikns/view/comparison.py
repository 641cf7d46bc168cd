"""Learned against analytic null spaces in one figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ikns.analysis.compare import Crosstalk, NullSpaceComparison
from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.style import BLUE, GREY, INK, MARKS, figure_style, new_figure


def comparison_figure(
    found: Mapping[str, NullSpaceComparison],
    *,
    simulated: bool,
    crosstalk: Crosstalk | None = None,
) -> Figure:
    """Draw angles, variance, leak and crosstalk, with intervals and chance levels.

    At most four comparisons by name, of one map, such as one for each task of the hand;
    the crosstalk is that of natural reaches. Points of the map are numbered from 1.
    """
    if not 1 <= len(found) <= len(MARKS):
        raise InvalidInput(
            f"expected 1 to {len(MARKS)} comparisons to draw, found {len(found)}."
        )
    most = max(len(each.points) for each in found.values())
    with figure_style():
        figure = new_figure(
            "Learned against analytic null space",
            simulated=simulated,
            height=2.6 + 0.42 * most,
        )
        angle, inside, leak, reach = figure.subplots(2, 2).flat
        shift = 0.22
        offsets = shift * (np.arange(len(found)) - (len(found) - 1) / 2)
        for (name, each), (color, mark), offset in zip(
            found.items(), MARKS, offsets, strict=False
        ):
            at = np.asarray(each.points + 1 + offset, dtype=np.float64)
            style = {"color": color, "marker": mark, "label": name}
            angles = _without_noise(each.angle_corrected, each.angles[:, -1])
            _dots(angle, np.degrees(angles), at, **style)
            _bars(angle, np.degrees(each.angle_interval), at, color)
            chance = np.degrees(each.chance_angles[0])
            angle.axvline(chance, color=color, ls="--", lw=0.9)
            _dots(inside, 100 * each.inside, at, **style)
            _bars(inside, 100 * each.inside_interval, at, color)
            inside.plot(
                100 * each.inside_chance[:, 1], at, "|", color=color, ms=7, mew=1.2
            )
        first = next(iter(found.values()))
        for dof in range(first.leak.shape[1]):
            at = np.asarray(first.points + 1 + shift * dof, dtype=np.float64)
            color, mark = MARKS[dof % len(MARKS)] if dof else (INK, "o")
            leaks = _without_noise(first.leak_corrected, first.leak)[:, dof]
            _dots(leak, 1000 * leaks, at, color=color, marker=mark)
            _bars(leak, 1000 * first.leak_interval[:, dof], at, color)
        ends = first.points + 1
        leak.plot(1000 * first.straight_leak, ends, "x", color=GREY, ms=5, mew=1.2)
        angle.set_title("Angle")
        angle.set_xlabel("largest principal angle (deg);  dashed: 1 random in 20 below")
        angle.set_xlim(left=0)
        inside.set_title("Joint variance inside the null space")
        inside.set_xlabel("share (%);  tick: 1 random in 20 above")
        inside.set_xlim(0, 101)
        leak.set_title("Leak")
        leak.set_xlabel("hand displacement per unit of c (mm);  x: straight Z, its end")
        leak.set_xlim(left=0)
        for axes in (angle, inside, leak):
            axes.set_ylim(max(each.points.max() for each in found.values()) + 1.7, 0.3)
            axes.set_yticks(
                np.unique(np.concatenate([each.points for each in found.values()])) + 1
            )
            axes.tick_params(axis="y", length=0)
            axes.grid(axis="y")
            axes.spines["left"].set_visible(False)
            axes.set_ylabel("PCA point")
        _draw_crosstalk(reach, crosstalk)
        handles, names = angle.get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower left", ncols=2)
    return figure


def _without_noise(corrected: Array, found: Array) -> Array:
    """Take corrected values, those found where there are none."""
    return np.where(np.isnan(corrected), found, corrected)


def _dots(axes: Axes, values: Array, at: Array, **style: Any) -> None:
    axes.plot(values, at, ls="none", ms=5.5, mew=0, **style)


def _bars(axes: Axes, interval: Array, at: Array, color: str) -> None:
    axes.hlines(at, interval[:, 0], interval[:, 1], color=color, lw=1.6, alpha=0.6)


def _draw_crosstalk(axes: Axes, found: Crosstalk | None) -> None:
    axes.set_title("Crosstalk")
    if found is None:
        axes.text(0.5, 0.5, "no reaches given", ha="center", va="center", color=GREY)
        axes.set_axis_off()
        return
    axes.plot(found.distance, np.abs(found.change), "o", color=BLUE, ms=4.5, mew=0)
    far = np.array([0.0, found.distance.max()])
    axes.plot(far, found.per_meter * far, color=INK)
    low, high = (end * far for end in found.per_meter_interval)
    axes.fill_between(far, low, high, color=GREY, alpha=0.25, lw=0)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("reach, rest to rest (m);  line: sum of changes over sum of ways")
    axes.set_ylabel("change of c")
