"""What a conductor has to know of the tracking experiment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ikns.errors import NotEnoughData
from ikns.experiments.tracking import Attempt, Profile, Step, Visit, measure
from ikns.experiments.tracking.trial import ALIGN, View
from ikns.experiments.visits import tracking_row

__all__ = ["TrackingDesk"]

#: Points of the curve that a screen draws, s apart: the fastest move goes 2 of 100 in
#: that time.
_CURVE = 0.04
#: A sample may be so much older than the time at which it is taken, s: only without
#: any does time pass.
_BEHIND = 0.05
_PROMPTS = {
    "align": "Bring the pointer to the start of the line",
    "track": "Follow the line",
}


class TrackingDesk:
    """A tracking visit as it is conducted.

    Parameters
    ----------
    steps : sequence of Step
        From :func:`ikns.experiments.tracking.schedule`.
    rows : iterable of mapping
        Attempts of a visit that goes on.
    align : float
        Time before each profile, s.
    """

    experiment = "tracking"
    #: What a screen may ask beyond what every experiment knows.
    commands: frozenset[str] = frozenset()
    #: Whether a trial makes sense only with a control signal.
    needs_signal = True

    def __init__(
        self,
        steps: Sequence[Step],
        rows: Iterable[Mapping[str, Any]] = (),
        *,
        align: float = ALIGN,
    ) -> None:
        before = [Attempt(r["key"], r["outcome"], r["reason"]) for r in rows]
        self.visit = Visit(steps, before, align=align)
        self._steps = {step.key: step for step in steps}
        self._view: View | None = None
        self._began = math.nan

    def begin(self, now: float) -> None:
        """Start the current trial."""
        trial = self.visit.begin(now)
        self._view, self._began = trial.check(now), now

    def frame(self, now: float, c: float) -> None:
        """Take a control signal."""
        if self.visit.trial is not None:
            self._view = self.visit.trial.frame(now, c)

    def check(self, now: float) -> None:
        """Put down a trial that has come to its end."""
        if self.visit.trial is not None and not self.visit.finish():
            self._view = self.visit.trial.check(now - _BEHIND)
            self.visit.finish()

    def abort(self, now: float, reason: str) -> None:
        """Break the trial off."""
        self.visit.abort(now, reason)

    def skip(self, now: float, reason: str) -> None:
        """Leave the current step out."""
        self.visit.skip(now, reason)

    def ask(self, name: str, text: str, now: float) -> None:
        """Nothing more may be asked."""

    def state(self) -> str:
        """Of the trial that goes on; empty without one."""
        trial = self.visit.trial
        return "" if trial is None else trial.state

    def trial(self) -> tuple[Profile, float] | None:
        """Profile of the trial that goes on, and when it begins, s."""
        going = self.visit.trial
        return None if going is None else (going.profile, self._began + going.align)

    def view(self, now: float) -> dict[str, Any]:
        """Return what screens show of the trial that goes on."""
        trial, view = self.visit.trial, self._view
        if trial is None or view is None:
            return {}
        # Time goes on between samples.
        time = min(
            max(view.time, now - self._began - trial.align), trial.profile.seconds
        )
        return {
            "time": time,
            "x": max(0.0, time / trial.profile.seconds),
            "y": view.y,
            "target": view.target,
            "countdown": max(0.0, -time),
            "left": trial.profile.seconds - max(0.0, time),
        }

    def prompt(self, state: str) -> str:
        """Return what the participant is told."""
        return _PROMPTS.get(state, "")

    def curve(self) -> dict[str, Any]:
        """Whole profile of the trial that goes on, to draw."""
        trial = self.visit.trial
        if trial is None:
            return {}
        seconds = trial.profile.seconds
        time = np.linspace(0, seconds, math.ceil(seconds / _CURVE) + 1)
        return {
            "seconds": seconds,
            "align": trial.align,
            "heights": np.round(trial.profile.at(time), 2).tolist(),
        }

    def facts(self, step: Step) -> dict[str, Any]:
        """Return what the panel says of a step."""
        return {"what": step.profile, "repeat": step.repeat + 1}

    def row(self, number: int, attempt: Attempt, *, practised: int) -> dict[str, Any]:
        """Return an attempt as it goes to disk."""
        return tracking_row(
            number,
            self._steps[attempt.key],
            attempt,
            align=self.visit.align,
            practised=practised,
        )

    def result(self, attempt: Attempt) -> dict[str, float]:
        """Figures of an attempt that was recorded to its end."""
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
