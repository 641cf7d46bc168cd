"""RMSE over a participant's trials, with the curves that were fitted."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ikns.experiments.study.summary import TrackingSummary
from ikns.experiments.study.summary.trials import Columns
from ikns.statistics import LearningCurve, LearningCurves
from ikns.view.study_report.drawing import looks, outside_legend, study_figure
from ikns.view.style import GREEN, GREY, INK, PALE, PURPLE, house_style

__all__ = ["learning_figure"]

Array = NDArray[np.float64]
_LINES = {
    "constant": (GREY, ":"),
    "exponential": (GREEN, "-"),
    "power law": (PURPLE, "--"),
}


def learning_figure(found: TrackingSummary) -> Figure:
    """Mean over participants by trial, each trajectory's own difficulty taken out.

    Training is on other curves, so that it stands apart and as it was measured.
    """
    fitted: dict[str, LearningCurves] = {}
    for compared in found.comparisons:
        if compared.analysis is not None:
            fitted = compared.analysis.learning | fitted
    style = looks(found.conditions)
    trials, training = found.trials(), found.trials("training")
    with house_style():
        figure = study_figure("RMSE over trials", simulated=found.simulated, height=3.0)
        panels = figure.subplots(1, len(found.conditions), sharey=True, squeeze=False)[
            0
        ]
        for axes, condition in zip(panels, found.conditions, strict=True):
            look = style[condition]
            before, raw, _ = _by_trial(training, condition, level=False)
            first = int(before.max()) if len(before) else 0
            axes.plot(
                before - first,
                raw,
                look.mark,
                mfc="white",
                mec=look.color,
                ms=4,
                label="training",
            )
            number, mean, spread = _by_trial(trials, condition, level=True)
            axes.errorbar(
                number,
                mean,
                spread,
                fmt=look.mark,
                color=look.color,
                ms=4,
                capsize=2,
                lw=0.8,
                label="trials",
            )
            curves = fitted.get(condition)
            if curves is not None and len(number):
                k = np.linspace(1, number.max(), 200)
                for curve in curves.curves:
                    color, line = _LINES[curve.model]
                    y = _value(curve, k)
                    axes.plot(k, y, line, color=color, label=curve.model)
            axes.axvline(0.5, color=INK, lw=0.6)
            who = np.unique(trials["subject"][trials["condition"] == condition])
            axes.set_title(f"{condition} (n = {len(who)})")
            axes.set_xlabel("trial in this condition")
            axes.yaxis.grid(visible=True, color=PALE)
        panels[0].set_ylim(bottom=0)
        panels[0].set_ylabel("RMSE (of 100)")
        outside_legend(figure, panels[0])
    return figure


def _by_trial(
    table: Columns, condition: str, *, level: bool
) -> tuple[Array, Array, Array]:
    """Trial numbers, mean over rows and their standard deviation."""
    rows = table["condition"] == condition
    y, number = table["rmse"][rows].astype(float), table["trial"][rows]
    if level and len(y):
        where = table["trajectory"][rows]
        for name in np.unique(where):
            y = np.where(where == name, y - y[where == name].mean(), y)
        y = y + float(table["rmse"][rows].mean())
    once = np.unique(number)
    groups = [y[number == k] for k in once]
    return (
        once.astype(float),
        np.array([group.mean() for group in groups]),
        np.array([group.std(ddof=1) if len(group) > 1 else 0.0 for group in groups]),
    )


def _value(curve: LearningCurve, k: Array) -> Array:
    if curve.model == "exponential":
        return np.asarray(curve.final + curve.gain * np.exp(-(k - 1) / curve.rate))
    if curve.model == "power law":
        return np.asarray(curve.final + curve.gain * k**-curve.rate)
    return np.full(len(k), curve.final)
