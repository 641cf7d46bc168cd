"""One figure a question, in the package's own style."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ikns.view.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    figure_style,
    new_figure,
)
from interpolation.field import PAPER_LAYOUT
from interpolation.schemes import PAPER, SCHEMES
from interpolation.spread import column, middle

__all__ = ["layouts_figure", "save", "schemes_figure", "sweep_figure"]

People = Sequence[dict]

#: Told apart by shape as well as by color.
_MARKS = (
    (BLUE, "o"),
    (ORANGE, "D"),
    (GREEN, "s"),
    (PURPLE, "^"),
    (RED, "v"),
    (SKY, "P"),
    (INK, "X"),
)
_KINDS = {
    "": "in the box, habits vary",
    "inside_": "inside the hull, habits alike",
    "outside_": "outside the hull, habits alike",
    "left_out_": "leave one point out",
}
_DPI = 150


def save(figure: Figure, folder: Path, name: str) -> Path:
    """Write a figure as PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    with figure_style():
        figure.savefig(folder / f"{name}.png", dpi=_DPI)
    return folder / f"{name}.png"


def schemes_figure(people: People) -> Figure:
    """Errors and jumps of every scheme on ten points."""
    names = list(SCHEMES)
    at = np.arange(len(names))
    with figure_style():
        figure = new_figure(
            f"Which interpolation? Ten points, {len(people)} people",
            simulated=True,
            height=5.2,
        )
        panels = figure.subplots(1, 3, sharey=True)
        for axes, what, title in (
            (panels[0], "angle", "error of the direction, deg"),
            (panels[1], "c", "error of c, % of the range"),
        ):
            for k, (kind, label) in enumerate(_KINDS.items()):
                color, mark = _MARKS[k]
                y = at + 0.17 * (k - 1.5)
                _dots(axes, people, names, f"{kind}{what}", y, color, mark, label)
            axes.set_xlabel(title)
            axes.set_xlim(left=0)
        for axes in panels[:1]:
            axes.set_yticks(at, names)
            axes.set_ylim(len(names) - 0.4, -0.6)
            axes.get_yticklabels()[names.index(PAPER)].set_fontweight("bold")
        for k, (what, label) in enumerate(
            (("frame_worst", "in 10 ms on a reach"), ("jump_worst", "across the hull"))
        ):
            color, mark = (_MARKS[4], _MARKS[6])[k]
            y = at + 0.22 * (k - 0.5)
            _dots(panels[2], people, names, what, y, color, mark, label)
        panels[2].set_xlabel("largest step of c, % of the range")
        panels[2].set_xscale("symlog", linthresh=1.0)
        panels[2].set_xticks([0, 1, 3, 10, 30], ["0", "1", "3", "10", "30"])
        panels[2].set_xlim(-0.1, None)
        for axes in panels:
            axes.tick_params(axis="y", length=0)
            axes.grid(axis="x")
            for y in at[::2]:
                axes.axhspan(y - 0.5, y + 0.5, color="#F6F6F6", zorder=0, lw=0)
        handles, labels = panels[0].get_legend_handles_labels()
        more, texts = panels[2].get_legend_handles_labels()
        figure.legend(handles + more, labels + texts, loc="outside lower left", ncols=3)
    return figure


def _dots(
    axes: Axes,
    people: People,
    names: Sequence[str],
    what: str,
    y: np.ndarray,
    color: str,
    mark: str,
    label: str,
) -> None:
    """Median person, and a line from the best to the worst."""
    values = np.array([[one["schemes"][n][what] for one in people] for n in names])
    low, high = values.min(axis=1), values.max(axis=1)
    axes.hlines(y, low, high, color=color, lw=1.0, alpha=0.6)
    axes.plot(
        np.median(values, axis=1), y, mark, color=color, ms=4.5, mew=0, label=label
    )


def layouts_figure(people: People) -> Figure:
    """Errors against the number of points, by layout and by scheme."""
    sizes = list(people[0]["layouts"][PAPER_LAYOUT])
    paper = [one["layouts"][PAPER_LAYOUT] for one in people]
    minutes = [middle([one[n] for one in paper], "minutes") for n in sizes]
    with figure_style():
        figure = new_figure(
            f"How many points, and where? {len(people)} people",
            simulated=True,
            height=6.6,
        )
        panels = figure.subplots(2, 2, sharex=True)
        for row, (of, title) in enumerate(
            (
                ("layouts", "by layout (natural neighbor)"),
                ("numbers", "by scheme (box surface)"),
            )
        ):
            for axes, what, unit in (
                (panels[row, 0], "angle", "error of the direction, deg"),
                (panels[row, 1], "c", "error of c, % of the range"),
            ):
                names = [name for name in people[0][of] if name != "nearest point"]
                for k, name in enumerate(names):
                    color, mark = _MARKS[k]
                    there = [one[of][name] for one in people]
                    ns = list(there[0])
                    y = [middle([t[n] for t in there], what) for n in ns]
                    axes.plot(
                        ns, y, color=color, marker=mark, ms=4.5, mew=0, label=name
                    )
                floor = middle([one["floor"] for one in people], what)
                axes.axhline(floor, color=GREY, ls="--", label="a visit right there")
                axes.set_ylabel(unit)
                axes.set_ylim(0, 1.05 * axes.get_ylim()[1])
                axes.grid(axis="y")
                axes.set_title(title)
            panels[row, 1].legend(
                *panels[row, 0].get_legend_handles_labels(),
                loc="center left",
                bbox_to_anchor=(1.0, 0.5),
            )
        for axes in panels[1]:
            axes.set_xscale("log")
            axes.set_xticks(
                sizes,
                [f"{n}\n{m:.1f}" for n, m in zip(sizes, minutes, strict=True)],
            )
            axes.minorticks_off()
            axes.set_xlabel("points, and minutes to record them (paper's layout)")
    return figure


def sweep_figure(
    what: str, paper: float | None, sweeps: dict[str, dict[float | None, People]]
) -> Figure:
    """Errors against gate, variance or radius."""
    name, factor = {
        "gate": ("gate on hand speed, m/s", 1.0),
        "variance": ("variance explained, %", 100.0),
        "radius": ("radius of a cluster, mm", 1000.0),
    }[what]
    settings = list(next(iter(sweeps.values())))
    at = np.arange(len(settings))
    ticks = ["rule" if v is None else f"{factor * v:g}" for v in settings]
    lines = (
        ("found", "points found"),
        ("own", "direction at the points, deg"),
        ("angle", "direction between, deg"),
        ("c", "c between, % of the range"),
    )
    if what == "variance":
        lines = (("components", "components summed"), *lines[1:])
    people = len(next(iter(next(iter(sweeps.values())).values())))
    with figure_style():
        figure = new_figure(
            f"Which {what}? Recorded with markers, {people} people",
            simulated=True,
            height=3.2,
        )
        panels = figure.subplots(1, 4)
        for axes, (key, title) in zip(panels, lines, strict=True):
            for k, (condition, by_setting) in enumerate(sweeps.items()):
                color, mark = _MARKS[k]
                values = [column(rows, key) for rows in by_setting.values()]
                usual = [middle(rows, key) for rows in by_setting.values()]
                low = [np.nanmin(v) if np.isfinite(v).any() else np.nan for v in values]
                high = [
                    np.nanmax(v) if np.isfinite(v).any() else np.nan for v in values
                ]
                x = at + 0.12 * (k - (len(sweeps) - 1) / 2)
                axes.vlines(x, low, high, color=color, lw=1.0, alpha=0.6)
                # No line to the rule: it is no number.
                first = settings.count(None)
                axes.plot(x[:first], usual[:first], mark, color=color, ms=4.0, mew=0)
                axes.plot(
                    x[first:],
                    usual[first:],
                    color=color,
                    marker=mark,
                    ms=4.0,
                    mew=0,
                    label=condition,
                )
            axes.axvline(settings.index(paper), color=GREY, ls=":", zorder=0)
            axes.set_title(title)
            axes.set_xticks(at, ticks)
            axes.set_ylim(0, 1.05 * axes.get_ylim()[1])
            axes.grid(axis="y")
        handles, labels = panels[0].get_legend_handles_labels()
        labels = [f"{label} hand" for label in labels]
        figure.legend(handles, labels, loc="outside lower left", ncols=3)
        dotted = "the paper's" if paper is not None else "the package's rule"
        figure.supxlabel(f"{name};  dotted: {dotted}", x=0.99, ha="right", fontsize=8.5)
    return figure
