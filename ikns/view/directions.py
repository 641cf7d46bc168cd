"""Learned directions at each PCA point, by joint and against the analytic ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.style import (
    BLUE,
    GREY,
    INK,
    MARKS,
    ORANGE,
    RED,
    figure_style,
    joint_labels,
    new_figure,
)

_COLUMNS = 5
_MARKS = (*MARKS, (RED, "v"))


def directions_figure(
    directions: ArrayLike,
    joint_names: Sequence[str],
    *,
    simulated: bool,
    analytic: ArrayLike | None = None,
) -> Figure:
    """Draw the components of direction Z at every PCA point, one bar per joint.

    Parameters
    ----------
    directions : (P, n) or (P, d, n) array
        Learned unit directions; a point without one is NaN.
    joint_names : sequence of n str
        In chain order; drawn from top to bottom.
    analytic : array like `directions`, optional
        The Jacobian's directions, drawn as wide pale bars behind.
    """
    learned = _stacked(directions, len(joint_names))
    behind = None if analytic is None else _stacked(analytic, len(joint_names))
    if behind is not None and behind.shape != learned.shape:
        raise InvalidInput(
            "learned and analytic directions must have one shape, "
            f"found {learned.shape} and {behind.shape}."
        )
    n_points, n_dof, n_joints = learned.shape
    panels = [(point, dof) for dof in range(n_dof) for point in range(n_points)]
    columns = min(_COLUMNS, n_points)
    rows = -(-len(panels) // columns)
    at = np.arange(n_joints)
    with figure_style():
        figure = new_figure(
            "Direction Z at each PCA point",
            simulated=simulated,
            height=1.1 + rows * (0.42 + 0.175 * n_joints),
            width=max(7.5, 1.8 * columns),
        )
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes, (point, dof) in zip(grid.flat, panels, strict=False):
            axes.axvline(0, color=INK, lw=0.7)
            if behind is not None:
                values = behind[point, dof]
                axes.barh(at, values, 0.78, color=ORANGE, alpha=0.55, label="analytic")
            axes.barh(at, learned[point, dof], 0.36, color=BLUE, label="learned")
            which = f", direction {dof + 1}" if n_dof > 1 else ""
            axes.set_title(f"point {point + 1}{which}")
            if np.isnan(learned[point, dof]).any():
                axes.text(0, at.mean(), "no direction", ha="center", color=GREY)
            axes.grid(axis="x")
            axes.tick_params(length=0)
        first = grid.flat[0]
        first.set_xlim(-1, 1)
        first.set_xticks([-1, 0, 1], ["−1", "0", "+1"])
        first.set_yticks(at, joint_labels(joint_names))
        first.set_ylim(n_joints - 0.4, -0.6)
        for axes in grid.flat[len(panels) :]:
            axes.set_axis_off()
        figure.supxlabel(
            "component of the unit vector Z (no unit);  "
            "positive: the angle grows as c rises",
            fontsize=8.5,
        )
        handles, names = first.get_legend_handles_labels()
        figure.legend(
            handles[::-1], names[::-1], loc="outside upper right", ncols=len(names)
        )
    return figure


def principal_angle_figure(
    angles: Mapping[str, ArrayLike], *, simulated: bool, goal: float | None = None
) -> Figure:
    """Draw the angle between learned and analytic null space at every PCA point.

    Parameters
    ----------
    angles : mapping of name to (P,) array
        Principal angle per point, radians, for each analytic null space compared with;
        NaN where a point has no direction.
    goal : float, optional
        Angle that should not be exceeded, radians; drawn as a line.
    """
    series = {name: np.asarray(given, dtype=float) for name, given in angles.items()}
    sizes = {values.shape for values in series.values()}
    if len(sizes) != 1 or len(next(iter(sizes))) != 1:
        raise InvalidInput(f"expected angles (P,) of one length, found {sizes}.")
    n_points = next(iter(sizes))[0]
    at = np.arange(1, n_points + 1)
    with figure_style():
        figure = new_figure(
            "Learned against analytic null space",
            simulated=simulated,
            height=1.3 + 0.22 * n_points,
            width=7.0,
        )
        axes = figure.add_subplot()
        axes.hlines(at, 0, 1, color="#EFEFEF", transform=axes.get_yaxis_transform())
        for k, (name, values) in enumerate(series.items()):
            color, mark = _MARKS[k % len(_MARKS)]
            axes.plot(
                np.rad2deg(values), at, mark, color=color, ms=6, mew=0, label=name
            )
        top = max(float(np.nanmax(values, initial=0)) for values in series.values())
        if goal is not None:
            name = f"goal: at most {np.rad2deg(goal):.3g} deg"
            axes.axvline(np.rad2deg(goal), color=RED, ls="--", label=name)
        limit = np.rad2deg(max(top, goal or 0.0))
        axes.set_xlim(0, max(1.0, 1.1 * limit))
        axes.set_ylim(n_points + 0.6, 0.4)
        axes.set_yticks(at)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
        axes.set_ylabel("PCA point")
        axes.set_xlabel("principal angle (deg);  0 = the same direction")
        figure.legend(loc="outside lower left", ncols=2)
    return figure


def _stacked(directions: ArrayLike, n_joints: int) -> Array:
    array = np.asarray(directions, dtype=np.float64)
    if array.ndim == 2:
        array = array[:, None, :]
    if array.ndim != 3 or array.shape[2] != n_joints or not array.size:
        raise InvalidInput(
            f"expected directions (P, n) or (P, d, n) for n = {n_joints} joints, "
            f"found {np.shape(directions)}."
        )
    return array
