"""The tracking experiment while it is conducted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ikns.errors import NotEnoughData
from ikns.experiments.tracking import (
    Attempt,
    Profile,
    TrackingStep,
    Visit,
    measure,
)
from ikns.experiments.tracking.trial import ALIGN, TrackingView
from ikns.experiments.visits import tracking_row

#: Step between the points of the curve that pages draw, s: the fastest move covers 2 of
#: 100 in that time.
_CURVE_STEP = 0.04
#: Samples may arrive this late, s: the trial's time waits for them, and passes without
#: them only then.
_SAMPLE_DELAY = 0.05
_PROMPTS = {
    "align": "Bring the pointer to the start of the line",
    "track": "Follow the line",
}


class TrackingExperiment:
    """A tracking visit.

    Parameters
    ----------
    steps : sequence of TrackingStep
        From :func:`ikns.experiments.tracking.schedule`.
    rows : iterable of mapping
        Attempts of earlier runs of the visit.
    align : float
        Time before each profile, s.
    """

    name = "tracking"
    #: Commands beyond those of every experiment.
    commands: frozenset[str] = frozenset()
    #: Whether a trial needs a control signal.
    needs_signal = True

    def __init__(
        self,
        steps: Sequence[TrackingStep],
        rows: Iterable[Mapping[str, Any]] = (),
        *,
        align: float = ALIGN,
    ) -> None:
        before = [Attempt(r["key"], r["outcome"], r["reason"]) for r in rows]
        self.visit = Visit(steps, before, align=align)
        self._steps = {step.key: step for step in steps}
        self._view: TrackingView | None = None
        self._began = math.nan

    def begin(self, now: float) -> None:
        """Start the current trial."""
        trial = self.visit.begin(now)
        self._view, self._began = trial.update(now), now

    def add_sample(self, now: float, c: float) -> None:
        """Take the control signal at a time."""
        if self.visit.trial is not None:
            self._view = self.visit.trial.add_sample(now, c)

    def update(self, now: float) -> None:
        """Let time pass; record a trial that has ended."""
        if self.visit.trial is not None and not self.visit.finish():
            self._view = self.visit.trial.update(now - _SAMPLE_DELAY)
            self.visit.finish()

    def abort(self, now: float, reason: str) -> None:
        """Abort the trial."""
        self.visit.abort(now, reason)

    def skip(self, now: float, reason: str) -> None:
        """Skip the current step."""
        self.visit.skip(now, reason)

    def execute(self, name: str, text: str, now: float) -> None:
        """Do nothing: there are no commands of its own."""

    def state(self) -> str:
        """Return the state of the running trial; empty without one."""
        trial = self.visit.trial
        return "" if trial is None else trial.state

    def trial(self) -> tuple[Profile, float] | None:
        """Return the running trial's profile, and when the profile begins, s."""
        trial = self.visit.trial
        return None if trial is None else (trial.profile, self._began + trial.align)

    def view(self, now: float) -> dict[str, Any]:
        """Return what pages show of the running trial."""
        trial, view = self.visit.trial, self._view
        if trial is None or view is None:
            return {}
        # Time passes between samples, too.
        time = min(
            max(view.time, now - self._began - trial.align), trial.profile.seconds
        )
        return {
            "time": time,
            "x": max(0.0, time / trial.profile.seconds),
            "y": view.y,
            "target": view.target,
            "countdown": max(0.0, -time),
            "time_left": trial.profile.seconds - max(0.0, time),
        }

    def prompt(self, state: str) -> str:
        """Return the instruction to the participant."""
        return _PROMPTS.get(state, "")

    def curve(self) -> dict[str, Any]:
        """Return the whole profile of the running trial, to draw."""
        trial = self.visit.trial
        if trial is None:
            return {}
        seconds = trial.profile.seconds
        time = np.linspace(0, seconds, math.ceil(seconds / _CURVE_STEP) + 1)
        return {
            "seconds": seconds,
            "align": trial.align,
            "heights": np.round(trial.profile.at(time), 2).tolist(),
        }

    def describe(self, step: TrackingStep) -> dict[str, Any]:
        """Return what pages show of a step."""
        return {"what": step.profile, "repeat": step.repeat + 1}

    def row(self, number: int, attempt: Attempt, *, practised: int) -> dict[str, Any]:
        """Return an attempt as a row of the visit's table."""
        return tracking_row(
            number,
            self._steps[attempt.key],
            attempt,
            align=self.visit.align,
            practised=practised,
        )

    def metrics(self, attempt: Attempt) -> dict[str, float]:
        """Return the metrics of an attempt that ran to its end."""
        if attempt.outcome != "done" or attempt.record is None:
            return {}
        try:
            found = measure(attempt.record)
        except NotEnoughData:
            return {}
        return {
            "rmse": found.rmse,
            "mae": found.mae,
            "lag": found.lag,
            "unseen": found.unseen,
        }
