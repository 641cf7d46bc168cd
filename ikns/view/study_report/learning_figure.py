"""RMSE over trials, with the fitted learning curves."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ikns.experiments.study.summary import TrackingSummary
from ikns.experiments.study.summary.by_trial import rmse_by_trial
from ikns.statistics import LearningCurves
from ikns.view.study_report.comparisons import (
    condition_styles,
    study_figure,
)
from ikns.view.style import GREEN, GREY, INK, PALE, PURPLE, figure_style, outside_legend

_LINES = {
    "constant": (GREY, ":"),
    "exponential": (GREEN, "-"),
    "power law": (PURPLE, "--"),
}


def learning_figure(found: TrackingSummary) -> Figure:
    """Draw the mean by trial, corrected for the difficulty of each trajectory.

    Training is on other trajectories and is drawn uncorrected.
    """
    fitted: dict[str, LearningCurves] = {}
    for compared in found.comparisons:
        if compared.analysis is not None:
            fitted = compared.analysis.learning | fitted
    style = condition_styles(found.conditions)
    trials, training = found.trials(), found.trials("training")
    with figure_style():
        figure = study_figure("RMSE over trials", simulated=found.simulated, height=3.0)
        panels = figure.subplots(1, len(found.conditions), sharey=True, squeeze=False)[
            0
        ]
        for axes, condition in zip(panels, found.conditions, strict=True):
            color, mark = style[condition]
            before = rmse_by_trial(training, condition, center=False)
            axes.plot(
                before.trial - before.trial.max(initial=0),
                before.mean,
                mark,
                mfc="white",
                mec=color,
                ms=4,
                label="training",
            )
            during = rmse_by_trial(trials, condition, center=True)
            axes.errorbar(
                during.trial,
                during.mean,
                during.deviation,
                fmt=mark,
                color=color,
                ms=4,
                capsize=2,
                lw=0.8,
                label="trials",
            )
            curves = fitted.get(condition)
            if curves is not None and len(during.trial):
                k = np.linspace(1, during.trial.max(), 200)
                for curve in curves.curves:
                    color, line = _LINES[curve.model]
                    axes.plot(k, curve.at(k), line, color=color, label=curve.model)
            axes.axvline(0.5, color=INK, lw=0.6)
            who = np.unique(trials["subject"][trials["condition"] == condition])
            axes.set_title(f"{condition} (n = {len(who)})")
            axes.set_xlabel("trial in this condition")
            axes.yaxis.grid(visible=True, color=PALE)
        panels[0].set_ylim(bottom=0)
        panels[0].set_ylabel("RMSE (of 100)")
        outside_legend(figure, panels[0])
    return figure
