"""Difference against the declared margin, and standardized effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ikns.statistics import Effect, Equivalence
from ikns.view.study_report.drawing import study_figure
from ikns.view.style import BLUE, GREEN, GREY, INK, PALE, figure_style

__all__ = ["effect_figure"]

_BOX = {"facecolor": GREEN, "alpha": 0.13, "lw": 0}


def effect_figure(
    same: Equivalence | None,
    effects: Sequence[Effect],
    *,
    quantity: str,
    simulated: bool,
) -> Figure:
    """Draw the 90 % interval against the margin, next to standardized effects.

    Without a declared margin the first panel is left out. Standardized effects are
    drawn with their 95 % intervals; the quantity is such as ``RMSE``.
    """
    shown = [effect for effect in effects if not effect.unit]
    with figure_style():
        figure = study_figure(
            f"Difference of {quantity}", simulated=simulated, height=2.3
        )
        panels = figure.subplots(1, 1 if same is None else 2, squeeze=False)[0]
        if same is not None:
            axes = panels[0]
            axes.axvspan(-same.margin, same.margin, label="margin", **_BOX)
            axes.axvline(0, color=GREY, lw=0.8)
            axes.plot([same.low, same.high], [0, 0], color=BLUE, lw=2.2)
            axes.plot(same.difference, 0, "o", color=BLUE, ms=6)
            far = 1.15 * max(same.margin, abs(same.low), abs(same.high))
            axes.set_xlim(-far, far)
            axes.set_ylim(-1, 1)
            axes.set_yticks([])
            axes.spines["left"].set_visible(False)
            axes.set_title(
                f"{100 * (1 - 2 * same.alpha):g} % interval against the margin of "
                f"{same.margin:g}: {same.verdict}"
            )
            axes.set_xlabel(
                f"{quantity}, {same.names[0]} minus {same.names[1]} ({same.unit})"
            )
        axes = panels[-1]
        axes.axvline(0, color=GREY, lw=0.8)
        for place, effect in enumerate(reversed(shown)):
            if np.isfinite([effect.low, effect.high]).all():
                axes.plot([effect.low, effect.high], [place, place], color=INK, lw=1.6)
            axes.plot(effect.value, place, "s", color=INK, ms=5)
        axes.set_yticks(range(len(shown)), [effect.name for effect in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.xaxis.grid(visible=True, color=PALE)
        n = shown[0].subjects if shown else 0
        axes.set_title(f"standardized effects, 95 % intervals (n = {n})")
        if shown:
            names = shown[0].names
            axes.set_xlabel(f"{names[0]} minus {names[1]} (standard deviations)")
    return figure
