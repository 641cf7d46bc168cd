"""One pick and place trial. It has no clock: each call gives the time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ikns.errors import InvalidInput
from ikns.experiments.picking.schedule import PickStep

Ended = Literal["success", "dropped", "timeout", "aborted"]
State = Literal["waiting", "running", "success", "dropped", "timeout", "aborted"]


class PickView(NamedTuple):
    """What a screen shows of the trial.

    Parameters
    ----------
    state : {"waiting", "running", "success", "dropped", "timeout", "aborted"}
    time : float
        Since the start, s; 0 before it.
    left : float
        Until the limit, s.
    """

    state: State
    time: float
    left: float


@dataclass(frozen=True)
class PickRecord:
    """The result of a trial.

    Parameters
    ----------
    step : PickStep
    outcome : {"success", "dropped", "timeout", "aborted"}
    time : float
        From start to outcome, s, at most the limit; NaN when it never started.
    reason : str
        Why it was aborted.
    comment : str
        By the experimenter.
    """

    step: PickStep
    outcome: Ended
    time: float
    reason: str = ""
    comment: str = ""


class PickTrial:
    """A running trial, as a state machine: a key or a button starts and stops it.

    Parameters
    ----------
    step : PickStep
        Object and time limit.

    Attributes
    ----------
    state : str
    comment : str
        May be set at any time before the record is read.

    Examples
    --------
    >>> trial = PickTrial(PickStep("trial", "ikns", "A"))
    >>> trial.start(100.0)
    >>> trial.update(104.0).left
    16.0
    >>> trial.stop(108.5, "success").state, trial.record.time
    ('success', 8.5)
    """

    def __init__(self, step: PickStep) -> None:
        if step.kind == "rest" or not 0 < step.limit < math.inf:
            raise InvalidInput(
                f"expected a trial with a limit above 0 s, found a {step.kind} of "
                f"{step.limit:g} s."
            )
        self.step, self.comment = step, ""
        self.state: State = "waiting"
        self._zero = self._now = math.nan
        self._reason = ""

    def start(self, now: float) -> None:
        """Start the clock.

        Raises
        ------
        InvalidInput
            When it was started already, or the time is not finite.
        """
        if self.state != "waiting" or not math.isfinite(now):
            raise InvalidInput(
                f"expected to start a waiting trial at a finite time, found it "
                f"{self.state} at {now:g} s."
            )
        self._zero = self._now = now
        self.state = "running"

    def stop(self, now: float, outcome: Literal["success", "dropped"]) -> PickView:
        """Set the outcome; from the limit on it is always "timeout".

        A trial that has ended does not change: a second key press has no effect.

        Raises
        ------
        InvalidInput
            Before the start, or for another outcome.
        """
        if outcome not in ("success", "dropped"):
            raise InvalidInput(
                f"expected the outcome 'success' or 'dropped', found {outcome!r}."
            )
        if self.state == "waiting":
            raise InvalidInput("expected a trial that was started, found it waiting.")
        if self.update(now).state == "running":
            self.state = outcome
        return self.update(now)

    def update(self, now: float) -> PickView:
        """Let time pass; at the limit the trial ends."""
        if self.state == "running" and now > self._now:
            # The sum as a caller computes it, so that rounding cannot miss the limit.
            end = self._zero + self.step.limit
            self._now = min(now, end)
            if now >= end:
                self.state = "timeout"
        time = 0.0 if math.isnan(self._zero) else self._time()
        return PickView(self.state, time, self.step.limit - time)

    def abort(self, now: float, reason: str) -> None:
        """End the trial without an outcome."""
        if self.update(now).state in ("waiting", "running"):
            self.state, self._reason = "aborted", reason

    @property
    def record(self) -> PickRecord:
        """The result of a trial that has ended.

        Raises
        ------
        InvalidInput
            While the trial is running.
        """
        if self.state == "waiting" or self.state == "running":
            raise InvalidInput(f"expected a trial that ended, found it {self.state}.")
        return PickRecord(
            self.step, self.state, self._time(), self._reason, self.comment
        )

    def _time(self) -> float:
        if self.state == "timeout":
            return self.step.limit
        return min(self._now - self._zero, self.step.limit)
