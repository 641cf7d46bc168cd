"""Figures of experiment 1, in the paper's form."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ikns.experiments.study.summary import TrackingSummary
from ikns.experiments.study.summary.means import subject_means
from ikns.view.study_report.comparisons import (
    condition_styles,
    scatter_places,
    study_figure,
)
from ikns.view.style import GREY, INK, PALE, figure_style, outside_legend

#: Above so many participants single ones are drawn fainter.
_MANY = 40


def trace_figure(found: TrackingSummary) -> Figure:
    """Target and trace of the median trial, conditions by trajectories."""
    style = condition_styles(found.conditions)
    with figure_style():
        figure, panels = _grid(found, "Target and trace of the median trial", 1.9)
        for condition, trajectory, axes in panels:
            median = found.median_trial(condition, trajectory)
            if median is None:
                axes.set_title(f"{trajectory}, {condition}: no trial")
                continue
            record, _, rmse = median
            inside = record.time >= 0
            time = record.time[inside]
            axes.plot(time, record.target[inside], color=GREY, lw=2.6, alpha=0.55)
            axes.plot(time, record.y[inside], color=style[condition][0], lw=1.1)
            axes.set_title(f"{trajectory}, {condition}: RMSE {rmse:.2f}")
            axes.set_ylim(0, 100)
            axes.set_xlim(0, record.profile.seconds)
        figure.supylabel("height of the pointer, 100 c", fontsize=8.5)
        first = panels[0][2]
        first.plot([], [], color=GREY, lw=2.6, alpha=0.55, label="target")
        for condition in found.conditions:
            first.plot([], [], color=style[condition][0], label=condition)
        outside_legend(figure, first)
    return figure


def error_figure(found: TrackingSummary) -> Figure:
    """Error over time across participants: mean, and the band of 80 % of them."""
    style = condition_styles(found.conditions)
    with figure_style():
        figure, panels = _grid(found, "Error over time across participants", 1.8)
        for condition, trajectory, axes in panels:
            axes.axhline(0, color=GREY, lw=0.7)
            error = found.errors.get((condition, trajectory))
            if error is None:
                axes.set_title(f"{trajectory}, {condition}: no trial")
                continue
            color = style[condition][0]
            axes.fill_between(
                error.time,
                error.low,
                error.high,
                color=color,
                alpha=0.18,
                lw=0,
                label=f"{condition}: 10th to 90th percentile",
            )
            axes.plot(error.time, error.mean, color=color, label=f"{condition}: mean")
            axes.set_title(f"{trajectory}, {condition}: n = {int(error.count.max())}")
            axes.set_xlim(error.time[0], error.time[-1])
        figure.supylabel("pointer minus target (of 100)", fontsize=8.5)
    return figure


def _grid(
    found: TrackingSummary, title: str, height: float
) -> tuple[Figure, list[tuple[str, str, Any]]]:
    """Figure over time with one panel a condition (rows) and trajectory (columns).

    The height is that of a row, inches.
    """
    conditions, trajectories = found.conditions, found.trajectories
    figure = study_figure(
        title, simulated=found.simulated, height=0.7 + height * len(conditions)
    )
    grid = figure.subplots(
        len(conditions), len(trajectories), sharex=True, sharey=True, squeeze=False
    )
    figure.supxlabel("time (s)", fontsize=8.5)
    panels = [
        (condition, trajectory, axes)
        for condition, row in zip(conditions, grid, strict=True)
        for trajectory, axes in zip(trajectories, row, strict=True)
    ]
    return figure, panels


def rmse_figure(found: TrackingSummary) -> Figure:
    """RMSE by trajectory and condition: a dot a participant, lines join the same."""
    trials, style = found.trials(), condition_styles(found.conditions)
    levels = [*found.trajectories, ""] if found.trajectories else [""]
    cells = {(c.condition, c.level): c.over for c in found.rmse}
    with figure_style():
        figure = study_figure(
            "RMSE by trajectory and condition",
            simulated=found.simulated,
            height=3.4,
        )
        panels = figure.subplots(1, len(levels), sharey=True, squeeze=False)[0]
        for axes, level in zip(panels, levels, strict=True):
            here: Any = trials["trajectory"] == level if level else True
            means = [
                subject_means(trials, "rmse", (trials["condition"] == c) & here)
                for c in found.conditions
            ]
            people = sorted(set().union(*means))
            faint = 0.25 if len(people) > _MANY else 0.8
            shift = scatter_places(len(people), width=0.28)
            _join(axes, means, people, shift, alpha=faint / 2)
            for k, (condition, mean) in enumerate(
                zip(found.conditions, means, strict=True)
            ):
                color, mark = style[condition]
                values = [mean.get(who, np.nan) for who in people]
                axes.plot(
                    k + shift,
                    values,
                    mark,
                    color=color,
                    ms=3.6,
                    mew=0,
                    alpha=faint,
                    label=condition,
                )
                over = cells[condition, level]
                half = 0.0 if np.isnan(over.low) else over.high - over.mean
                axes.errorbar(
                    k + 0.3,
                    over.mean,
                    half,
                    fmt=mark,
                    color=INK,
                    ms=5,
                    capsize=3 if half else 0,
                    label="mean, 95 % interval",
                )
            n = max((cells[c, level].subjects for c in found.conditions), default=0)
            axes.set_title(f"{level or 'all'} (n = {n})")
            axes.set_xticks(range(len(found.conditions)), found.conditions)
            axes.set_xlim(-0.4, len(found.conditions) - 0.4)
            axes.yaxis.grid(visible=True, color=PALE)
        panels[0].set_ylim(bottom=0)
        panels[0].set_ylabel("RMSE (of 100)")
    return figure


def _join(
    axes: Any,
    means: list[dict[str, float]],
    people: list[str],
    shift: np.ndarray,
    *,
    alpha: float,
) -> None:
    """Join each participant's dots, as one line with gaps."""
    x, y = [], []
    for who, aside in zip(people, shift, strict=True):
        x += [*(k + aside for k in range(len(means))), np.nan]
        y += [*(mean.get(who, np.nan) for mean in means), np.nan]
    axes.plot(x, y, color=GREY, lw=0.7, alpha=alpha, zorder=1)
