"""What a conductor has to know of the pick and place experiment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

from ikns.errors import InvalidInput
from ikns.experiments.picking import PickAttempt, PickStep, PickVisit, load_objects

__all__ = ["PickingDesk"]

_PROMPTS = {
    "ready": "Get ready",
    "running": "Pick it up and put it down",
    "judge": "Done",
}


class PickingDesk:
    """A pick and place visit as it is conducted.

    ``begin`` makes a trial ready, ``toggle`` starts its clock and stops it, ``success``
    and ``dropped`` say how it went, at once or once the clock was stopped. Within the
    limit somebody has to stop the clock; then there is no hurry to judge.

    Parameters
    ----------
    steps : sequence of PickStep
        From :func:`ikns.experiments.picking.pick_schedule`.
    rows : iterable of mapping
        Attempts of a visit that goes on.
    """

    experiment = "picking"
    commands = frozenset({"toggle", "success", "dropped", "comment"})
    #: A finger that nothing drives cannot grasp.
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

    def frame(self, now: float, c: float) -> None:
        """Take a control signal, which a trial does not depend on."""

    def check(self, now: float) -> None:
        """Let the clock run; put down a trial that has ended."""
        if self.visit.trial is not None:
            self.visit.trial.check(self._time(now))
            self.visit.finish()

    def abort(self, now: float, reason: str) -> None:
        """Break the trial off."""
        self.visit.abort(self._time(now), reason)

    def skip(self, now: float, reason: str) -> None:
        """Leave the current step out."""
        self.visit.skip(self._time(now), reason)

    def ask(self, name: str, text: str, now: float) -> None:
        """Start or stop the clock, take an outcome or a comment."""
        trial, state = self.visit.trial, self.state()
        if trial is None:
            raise InvalidInput("expected a trial going on, found none: begin one.")
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
            raise InvalidInput(f"expected a clock that runs, found the trial {state}.")

    def state(self) -> str:
        """Return ready, running or judge; empty without a trial."""
        trial = self.visit.trial
        if trial is None:
            return ""
        if trial.state == "waiting":
            return "ready"
        return "running" if math.isnan(self._stopped) else "judge"

    def view(self, now: float) -> dict[str, Any]:
        """Return what screens show of the clock."""
        trial = self.visit.trial
        if trial is None or trial.state == "waiting":
            return {}
        seen = trial.check(self._time(now))
        return {"time": seen.time, "left": seen.left, "limit": trial.step.limit}

    def prompt(self, state: str) -> str:
        """Return what the participant is told."""
        return _PROMPTS.get(state, "")

    def curve(self) -> dict[str, Any]:
        """Return nothing: there is no curve."""
        return {}

    def facts(self, step: PickStep) -> dict[str, Any]:
        """Return what the panel says of a step."""
        name = self._names[step.object]
        return {"what": step.object, "name": name, "repeat": step.repeat + 1}

    def row(
        self, number: int, attempt: PickAttempt, *, practised: int
    ) -> dict[str, Any]:
        """Return an attempt as it goes to disk."""
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

    def result(self, attempt: PickAttempt) -> dict[str, float]:
        """Return the time of an attempt, s."""
        return {} if attempt.record is None else {"time": attempt.record.time}

    def _time(self, now: float) -> float:
        """Now, or when the clock was stopped."""
        return now if math.isnan(self._stopped) else self._stopped
