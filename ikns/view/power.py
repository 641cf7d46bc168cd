"""Power of a planned study by number of participants."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.errors import InvalidInput
from ikns.view.arrays import same_length, series
from ikns.view.style import BLUE, INK, ORANGE, figure_style, new_figure


def power_figure(
    participants: ArrayLike,
    power: ArrayLike,
    interval: ArrayLike,
    *,
    aim: str,
    target: float,
    simulated: bool,
    needed: int | None = None,
    declared: int | None = None,
    note: str = "",
) -> Figure:
    """Draw power over the number of participants with its Monte Carlo interval.

    Parameters
    ----------
    participants : (n,) array
        Increasing.
    power : (n,) array
        Share of simulated studies that reach the aim, 0 to 1.
    interval : (2, n) array
        Its Monte Carlo interval, low and high.
    aim : str
        Aim of a study, such as "equivalence within 1".
    target : float
        Target power, 0 to 1; drawn as a line.
    simulated : bool
        Whether the assumed spread comes from virtual subjects; the title says so.
    needed, declared : int, optional
        Fewest participants that reach the target; participants that the study declares.
    note : str
        Source of the assumed spread; printed below the axis.
    """
    n, share = series(participants, "participants"), series(power, "power")
    same_length(participants=n, power=share)
    both = np.asarray(interval, dtype=np.float64)
    if both.shape != (2, len(n)):
        raise InvalidInput(
            f"expected an interval (2, {len(n)}), low and high, found {both.shape}."
        )
    if not ((both >= 0) & (both <= 1)).all() or not ((share >= 0) & (share <= 1)).all():
        raise InvalidInput("expected power of 0 to 1, found a value outside.")
    with figure_style():
        figure = new_figure(
            "Power of the study that is planned, by simulation",
            simulated=simulated,
            height=3.6,
            width=6.5,
        )
        axes = figure.subplots()
        axes.fill_between(
            n, *(100 * both), color=BLUE, alpha=0.25, lw=0, label="95 % interval"
        )
        axes.plot(n, 100 * share, "o-", color=BLUE, ms=4, mew=0, label="power")
        axes.axhline(100 * target, color=INK, lw=0.8, ls=":", label="wanted")
        for number, color, dashes, name in (
            (needed, INK, "--", "needed"),
            (declared, ORANGE, "-.", "declared"),
        ):
            if number is not None:
                label = f"{name}: {number}"
                axes.axvline(number, color=color, lw=1.0, ls=dashes, label=label)
        axes.set_ylim(0, 100)
        axes.set_xlim(left=0)
        axes.set_xlabel("participants")
        axes.set_ylabel(f"studies that show\n{aim} (%)")
        axes.grid(axis="y")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        if note:
            figure.supxlabel(note, fontsize=6.5, color=INK, x=0.01, ha="left")
    return figure
