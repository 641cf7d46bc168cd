"""The state machine of a visit: trials, rests, breaks, pauses, and the end."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any

from ikns.errors import InvalidInput
from ikns.experiments.conduct.experiment import Experiment
from ikns.experiments.conduct.recorder import AttemptRecorder
from ikns.experiments.conduct.signal_monitor import SignalMonitor
from ikns.experiments.conduct.visit_log import VisitLog


class VisitState:
    """State of a running visit.

    Parameters
    ----------
    experiment : Experiment
    log : VisitLog
    page_conditions : collection of str
        Conditions whose signal comes from the participant's page.
    rest : float
        Length of a break that the experimenter gives, s.
    auto : float or None
        Begin each trial after waiting this long, s, and end when all are done; None:
        wait for commands.

    Attributes
    ----------
    signal : SignalMonitor
    recorder : AttemptRecorder
    remaining : tuple
        Steps still to do, the current one first.
    paused, stopped, over : bool
        Whether the visit is paused, was stopped in an emergency, was ended.
    trials_begun : int
    message : str
        Answer to the last command; a refusal disappears when the visit's situation has
        changed, because it may no longer hold.
    on_event : callable or None
        Called with name, text and time (s) of what happens; changes with the source.
    listener : callable or None
        Likewise, for the whole visit.
    """

    def __init__(
        self,
        experiment: Experiment,
        log: VisitLog,
        *,
        page_conditions: Collection[str],
        rest: float,
        auto: float | None,
    ) -> None:
        self.experiment, self.log = experiment, log
        self.signal = SignalMonitor(page_conditions)
        self.recorder = AttemptRecorder(experiment, log)
        self.remaining: tuple[Any, ...] = experiment.visit.remaining
        self.paused = self.stopped = self.over = False
        self.trials_begun = 0
        self.message = ""
        self._refused_in: tuple[Any, ...] | None = None
        self.on_event: Callable[[str, str, float], None] | None = None
        self.listener: Callable[[str, str, float], None] | None = None
        self._rest, self._auto = rest, auto
        self._break_end = -math.inf
        self._start = self._waiting_since = math.nan

    @property
    def condition(self) -> str:
        """Condition of the running or next trial; empty without one."""
        if self.stopped or self.over:
            return ""
        return next((s.condition for s in self.remaining if s.kind != "rest"), "")

    @property
    def name(self) -> str:
        """Stopped, finished, rest, paused or waiting, or the state of the trial."""
        if self.stopped:
            return "stopped"
        if trial := self.experiment.state():
            return trial
        if not self.remaining:
            return "finished"
        if self.paused:
            return "paused"
        if self.remaining[0].kind == "rest" or self._on_break:
            return "rest"
        return "waiting"

    @property
    def _on_break(self) -> bool:
        return self._break_end > -math.inf

    def rest_left(self, now: float) -> float:
        """Time left of a break or a rest, s."""
        if self._on_break:
            return self._break_end - now
        return float(self.experiment.visit.rest(now))

    def begin(self, now: float) -> None:
        """Begin the current trial.

        Raises
        ------
        InvalidInput
            When none can begin now, or it lacks a control signal.
        """
        if self.paused:
            raise InvalidInput("the visit is paused; press Continue first.")
        if self._on_break:
            raise InvalidInput("a break is running; press Skip to end it first.")
        step = self.experiment.visit.current
        if step is not None and step.kind != "rest" and self.experiment.needs_signal:
            stop = self.signal.stop_notice()
            if stop is not None:
                raise InvalidInput(
                    f"{stop['title'].lower()} ({stop['reason'].rstrip('.')}); press "
                    "Connect again first."
                )
            missing = self.signal.missing(step.condition, now)
            if missing is not None:
                raise InvalidInput(f"no control signal from {step.condition}{missing}.")
        self.experiment.begin(now)
        self.clear_message()
        self.trials_begun += 1
        self.log_event("trial begins", self.experiment.visit.current.key, now)

    def reconnect(self, now: float) -> None:
        """Abort the running trial, if any: its signal begins anew.

        Raises
        ------
        InvalidInput
            When nothing has stopped.
        """
        stop = self.signal.stop_notice()
        if stop is None:
            raise InvalidInput("nothing has stopped; there is nothing to connect.")
        reason = stop["reason"].rstrip(".")
        self.abort(now, f"{stop['title'].lower()}: {reason}")

    def refuse(self, message: str, now: float) -> None:
        """Answer a command that cannot be executed."""
        self.message = f"{message[:1].upper()}{message[1:]}"
        self._refused_in = self._situation(now)

    def clear_message(self) -> None:
        """Forget the answer to the last command."""
        self.message, self._refused_in = "", None

    def _situation(self, now: float) -> tuple[Any, ...]:
        """Return everything on which a refusal may depend."""
        return (
            self.name,
            len(self.remaining),
            self.signal.stop_notice(),
            self.signal.missing(self.condition, now),
        )

    def abort(self, now: float, reason: str) -> None:
        """Abort the running trial, if any; it is repeated."""
        if self.experiment.state():
            self.experiment.abort(now, reason)
            self._refused_in = None
            self.message = f"The trial was aborted: {reason}."

    def skip(self, now: float, reason: str) -> None:
        """Skip a break, or the current step.

        Raises
        ------
        InvalidInput
            When none is left.
        """
        if self._on_break and not self.experiment.state():
            self._break_end = -math.inf
        elif self.experiment.visit.current is None:
            raise InvalidInput("all steps are done; there is none left to skip.")
        else:
            self.experiment.skip(now, reason)

    def start_break(self, now: float) -> None:
        """Give a break before the next trial.

        Raises
        ------
        InvalidInput
            When no trial comes next.
        """
        if self.experiment.state():
            raise InvalidInput("a trial is running; press Abort first.")
        step = self.experiment.visit.current
        if step is None or step.kind == "rest" or self._on_break:
            raise InvalidInput("no trial comes next, so a break is not needed.")
        self._break_end = now + self._rest
        self.log_event("break", f"{self._rest:g} s", now)

    def toggle_pause(self, now: float, text: str) -> None:
        """Begin a pause, or end it."""
        self.paused = not self.paused
        self.log_event("pause" if self.paused else "pause over", text, now)

    def set_page(self, connected: bool, now: float) -> None:
        """Note that the participant's page connected or disconnected."""
        self.signal.page_connected = connected
        words = "page came" if connected else "page left"
        self.log_event(words, self.condition, now)
        if not connected and self.condition in self.signal.page_conditions:
            self.abort(now, "the participant's page was closed")

    def stop(self, now: float) -> None:
        """Stop in an emergency: no trial begins any more."""
        if self.stopped:
            return
        self.abort(now, "emergency stop")
        self.record(now)
        self.stopped = True
        self.log_event("emergency stop", "", now)
        self.message = "Stopped. End the run; the same command continues from here."

    def end(self, now: float, reason: str) -> None:
        """End the visit; a running trial is aborted and repeated later."""
        self.abort(now, reason)
        self.record(now)
        self.over = True

    def advance(self, now: float) -> None:
        """Let rests and breaks end, and begin trials where that is automatic."""
        if self._refused_in not in (None, self._situation(now)):
            self.clear_message()
        if self.stopped or self.experiment.state():
            self._waiting_since = math.nan
            return
        if self.remaining and self.remaining[0].kind == "rest":
            self.experiment.visit.rest(now)
            self.remaining = self.experiment.visit.remaining
        if now >= self._break_end:
            self._break_end = -math.inf
        if self.name != "waiting":
            self._waiting_since = math.nan
            self.over |= self._auto is not None and self.name == "finished"
        elif math.isnan(self._waiting_since):
            self._waiting_since = now
        elif self._auto is not None and now - self._waiting_since >= self._auto:
            self._waiting_since = now
            try:
                self.begin(now)
            except InvalidInput as error:
                self.refuse(str(error), now)

    def record(self, now: float) -> None:
        """Write attempts that are new."""
        if math.isnan(self._start):
            self._start = now
        lines = self.recorder.record(now)
        for line in lines:
            self.log_event("trial ends", line, now)
        if lines:
            self.remaining = self.experiment.visit.remaining

    def log_event(self, name: str, text: str, now: float) -> None:
        """Write what happened into the log of the visit, and pass it on."""
        self.log.log_event(name, text, time=now - self._start)
        for listener in (self.on_event, self.listener):
            if listener:
                listener(name, text, now)
