"""Joint variance within and outside the null space, over a movement or by point."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.arrays import same_length, series
from ikns.view.style import BLUE, GREY, INK, ORANGE, figure_style, new_figure

_AXIS = {"time": "normalized time (%)", "points": "PCA point"}


def variance_split_figure(
    at: ArrayLike,
    v_ucm: ArrayLike,
    v_ort: ArrayLike,
    delta_vz: ArrayLike,
    *,
    simulated: bool,
    over: Literal["time", "points"] = "time",
    interval: ArrayLike | None = None,
    surrogates: ArrayLike | None = None,
    no_structure: float | None = None,
) -> Figure:
    """Draw V_UCM and V_ORT, and below them dVz with that of surrogates.

    Parameters
    ----------
    at : (T,) array
        Normalized time, %, or numbers of PCA points.
    v_ucm, v_ort : (T,) array
        Variance per degree of freedom, rad^2; NaN leaves a gap.
    delta_vz : (T,) array
        Log-transformed index.
    over : {"time", "points"}
        What `at` counts: time is drawn as lines, points as marks.
    interval, surrogates : (2, T) array, optional
        Low and high of dVz: its confidence interval, and the range of surrogates.
    no_structure : float, optional
        dVz of equal V_UCM and V_ORT, ln(d/k)/2; drawn as a line.
    """
    if over not in _AXIS:
        raise InvalidInput(f"over must be 'time' or 'points', not {over!r}.")
    x, z = series(at, "at"), series(delta_vz, "delta_vz")
    ucm, ort = series(v_ucm, "v_ucm"), series(v_ort, "v_ort")
    same_length(at=x, v_ucm=ucm, v_ort=ort, delta_vz=z)
    ranges = [_range(given, len(x)) for given in (interval, surrogates)]
    with figure_style():
        figure = new_figure(
            "Joint variance along and across the uncontrolled manifold",
            simulated=simulated,
            height=4.6,
            width=7.5,
        )
        upper, lower = figure.subplots(2, 1, sharex=True)
        # Distinct in dash and mark as well as in color.
        square = np.degrees(1.0) ** 2
        _draw(upper, over, x, ucm * square, BLUE, "V_UCM: unseen by the task")
        name = "V_ORT: moves the task"
        _draw(upper, over, x, ort * square, ORANGE, name, second=True)
        upper.set_ylabel("variance per DoF (deg²)")
        if over == "time" or not (np.nan_to_num([ucm, ort]) > 0).any():
            upper.set_ylim(bottom=0)
        else:  # a hand that is held keeps V_ORT a hundred times below V_UCM
            upper.set_yscale("log")
            upper.yaxis.set_major_formatter("{x:g}")
            upper.yaxis.set_minor_formatter("")
        _draw_index(lower, over, x, z, *ranges)
        if no_structure is not None:
            name = "V_UCM = V_ORT"
            lower.axhline(no_structure, color=INK, lw=0.8, ls=":", label=name)
        lower.set_ylabel("dVz (no unit)")
        lower.set_xlabel(_AXIS[over])
        if over == "points":
            lower.set_xticks(x)
        elif len(x) > 1:
            lower.set_xlim(x[0], x[-1])
        figure.align_ylabels()
        for axes in (upper, lower):
            axes.grid(axis="y")
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _draw_index(
    axes: Any, over: str, x: Array, z: Array, interval: Array | None, band: Array | None
) -> None:
    if band is not None:
        name = "surrogates: joints on their own"
        if over == "time":
            axes.fill_between(x, *band, color="#D9D9D9", lw=0, label=name)
        else:
            axes.vlines(x, *band, color="#CCCCCC", lw=9, label=name)
    if interval is not None:
        name = "confidence interval"
        if over == "time":
            axes.fill_between(x, *interval, fc="none", ec=BLUE, lw=0.8, label=name)
        else:
            axes.vlines(x, *interval, color=GREY, lw=1.2, label=name)
    _draw(axes, over, x, z, BLUE, "dVz")


def _draw(
    axes: Any,
    over: str,
    x: Array,
    y: Array,
    color: str,
    name: str,
    *,
    second: bool = False,
) -> None:
    if over == "time":
        axes.plot(x, y, color=color, ls="--" if second else "-", lw=1.6, label=name)
    else:
        mark = "D" if second else "o"
        axes.plot(x, y, mark, color=color, ms=5.5, mew=0, label=name)


def _range(given: ArrayLike | None, n: int) -> Array | None:
    if given is None:
        return None
    array = np.asarray(given, dtype=np.float64)
    if array.shape != (2, n):
        raise InvalidInput(
            f"expected a range (2, {n}), low and high, found {array.shape}."
        )
    return array
