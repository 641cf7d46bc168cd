"""The pick and place experiment while it is conducted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

from ikns.errors import InvalidInput
from ikns.experiments.picking import PickAttempt, PickStep, PickVisit, load_objects

_PROMPTS = {
    "ready": "Get ready",
    "running": "Pick it up and put it down",
    "judge": "Done",
}
#: What to do instead of a command that does not fit the trial.
_INSTEAD = {
    "ready": "the clock is not running; start it first.",
    "judge": "the clock has stopped; press Success or Dropped.",
}


class PickingExperiment:
    """A pick and place visit.

    ``begin`` makes a trial ready, ``toggle`` starts and stops its clock, ``success``
    and ``dropped`` give the outcome, while the clock runs or after it was stopped. The
    time limit holds for the clock, not for the judgment.

    Parameters
    ----------
    steps : sequence of PickStep
        From :func:`ikns.experiments.picking.pick_schedule`.
    rows : iterable of mapping
        Attempts of earlier runs of the visit.
    """

    name = "picking"
    commands = frozenset({"toggle", "success", "dropped", "comment"})
    #: A finger without a signal cannot grasp.
    needs_signal = True

    def __init__(
        self, steps: Sequence[PickStep], rows: Iterable[Mapping[str, Any]] = ()
    ) -> None:
        before = [PickAttempt(r["key"], r["outcome"], r["reason"]) for r in rows]
        self.visit = PickVisit(steps, before)
        self._steps = {step.key: step for step in steps}
        self._names = {code: thing.name for code, thing in load_objects().items()}
        self._stopped = math.nan

    def begin(self, now: float) -> None:
        """Make the current trial ready."""
        self.visit.begin()
        self._stopped = math.nan

    def add_sample(self, now: float, c: float) -> None:
        """Do nothing: the trial does not depend on the control signal."""

    def update(self, now: float) -> None:
        """Let the clock run; record a trial that has ended."""
        if self.visit.trial is not None:
            self.visit.trial.update(self._time(now))
            self.visit.finish()

    def abort(self, now: float, reason: str) -> None:
        """Abort the trial."""
        self.visit.abort(self._time(now), reason)

    def skip(self, now: float, reason: str) -> None:
        """Skip the current step."""
        self.visit.skip(self._time(now), reason)

    def execute(self, name: str, text: str, now: float) -> None:
        """Start or stop the clock, take an outcome or a comment."""
        trial, state = self.visit.trial, self.state()
        if trial is None:
            raise InvalidInput("no trial is running; begin one.")
        if text:
            trial.comment = text
        if name == "toggle" and state == "ready":
            trial.start(now)
        elif name == "toggle" and state == "running":
            self._stopped = now
        elif name in ("success", "dropped") and state in ("running", "judge"):
            outcome: Literal["success", "dropped"]
            outcome = "success" if name == "success" else "dropped"
            trial.stop(self._time(now), outcome)
            self.visit.finish()
        elif name != "comment":
            raise InvalidInput(_INSTEAD[state])

    def state(self) -> str:
        """Return ready, running or judge; empty without a trial."""
        trial = self.visit.trial
        if trial is None:
            return ""
        if trial.state == "waiting":
            return "ready"
        return "running" if math.isnan(self._stopped) else "judge"

    def view(self, now: float) -> dict[str, Any]:
        """Return what pages show of the clock."""
        trial = self.visit.trial
        if trial is None or trial.state == "waiting":
            return {}
        view = trial.update(self._time(now))
        return {"time": view.time, "time_left": view.left, "limit": trial.step.limit}

    def prompt(self, state: str) -> str:
        """Return the instruction to the participant."""
        return _PROMPTS.get(state, "")

    def curve(self) -> dict[str, Any]:
        """Return nothing: there is no curve."""
        return {}

    def describe(self, step: PickStep) -> dict[str, Any]:
        """Return what pages show of a step."""
        name = self._names[step.object]
        return {"what": step.object, "name": name, "repeat": step.repeat + 1}

    def row(
        self, number: int, attempt: PickAttempt, *, practised: int
    ) -> dict[str, Any]:
        """Return an attempt as a row of the visit's table."""
        step, record = self._steps[attempt.key], attempt.record
        return {
            "number": number,
            "key": step.key,
            "kind": step.kind,
            "condition": step.condition,
            "object": step.object,
            "repeat": step.repeat,
            "outcome": attempt.outcome,
            "reason": attempt.reason,
            "practised": practised,
            "time": math.nan if record is None else record.time,
            "limit": step.limit,
            "comment": "" if record is None else record.comment,
        }

    def metrics(self, attempt: PickAttempt) -> dict[str, float]:
        """Return the time of an attempt, s."""
        return {} if attempt.record is None else {"time": attempt.record.time}

    def _time(self, now: float) -> float:
        """Return now, or when the clock was stopped, s."""
        return now if math.isnan(self._stopped) else self._stopped
