"""Conducts a visit: commands and control signals in, screen contents out.

It has no screen, no web server and no clock. One thread calls
:meth:`Conductor.add_sample` and :meth:`Conductor.update`; :meth:`Conductor.submit` may
be called from any thread and puts commands into a queue. Only an emergency stop acts at
once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any

from ikns.errors import InvalidInput
from ikns.experiments.conduct.experiment import COMMANDS, Command, Experiment
from ikns.experiments.conduct.screen import (
    EMERGENCY,
    plan_steps,
    progress_facts,
    prompt,
)
from ikns.experiments.conduct.visit_log import VisitLog
from ikns.experiments.conduct.visit_state import VisitState

#: Attempts that the panel lists.
_LISTED = 8


class Conductor:
    """Conducts one visit.

    Parameters
    ----------
    experiment : Experiment
    log : VisitLog
        Where attempts are written, with those of earlier runs.
    page_conditions : collection of str
        Conditions whose signal comes from the participant's page: their trials are
        aborted when the page closes.
    rest : float
        Length of a break that the experimenter gives, s.
    auto : float, optional
        Begin each trial after waiting this long, s, and end when all are done. Default:
        wait for commands.
    on_event : callable, optional
        Called with name, text and time (s) of every event of the visit; must not wait.

    Attributes
    ----------
    shown : dict
        What pages show, as plain data; a new one after each update.
    plan, curve : dict
        Steps of the visit, and curve of the running trial, with a ``version`` each;
        they change rarely.
    emergency : threading.Event
        Set at once by an emergency stop, in any thread; it stays set.
    on_emergency : list of callable
        Called by an emergency stop, in the thread that submits it.
    on_arm : list of callable
        Called when the experimenter connects a stopped finger again; empty while there
        is no source of the signal, which is then opened again instead.

    Examples
    --------
    >>> import tempfile
    >>> from ikns.experiments.conduct.tracking import TrackingExperiment
    >>> from ikns.experiments.tracking import schedule
    >>> about = {"experiment": "tracking", "participant": "01", "simulated": False}
    >>> steps = schedule(0, conditions=["keyboard"], training=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = VisitLog(f"{folder}/visit", about)
    ...     conductor = Conductor(TrackingExperiment(steps), log)
    ...     conductor.add_sample(0.0, 0.5)
    ...     conductor.submit(Command("begin"))
    ...     for k in range(3010):
    ...         conductor.add_sample(k / 100, 0.5)
    ...         shown = conductor.update(k / 100)
    >>> shown["state"], shown["attempts"][0]["outcome"]
    ('waiting', 'done')
    """

    def __init__(
        self,
        experiment: Experiment,
        log: VisitLog,
        *,
        page_conditions: Collection[str] = (),
        rest: float = 120.0,
        auto: float | None = None,
        on_event: Callable[[str, str, float], None] | None = None,
    ) -> None:
        self.experiment, self.log = experiment, log
        self.emergency = Event()
        self.on_emergency: list[Callable[[], None]] = []
        self.on_arm: list[Callable[[], None]] = []
        self.plan: dict[str, Any] = {"version": 0}
        self.curve: dict[str, Any] = {"version": 0}
        self.shown: dict[str, Any] = {}
        self._commands: SimpleQueue[Command] = SimpleQueue()
        self._visit = VisitState(
            experiment, log, page_conditions=page_conditions, rest=rest, auto=auto
        )
        self._visit.listener = on_event
        self._reconnect = False
        self._planned = -1
        self._renew_plan()

    @property
    def results(self) -> list[dict[str, Any]]:
        """Each attempt with its metrics, those of earlier runs without."""
        return self._visit.recorder.results

    @property
    def condition(self) -> str:
        """Condition of the running or next trial; empty without one."""
        return self._visit.condition

    @property
    def state(self) -> str:
        """Stopped, finished, rest, paused or waiting, or the state of the trial."""
        return self._visit.name

    @property
    def over(self) -> bool:
        """Whether the visit was ended."""
        return self._visit.over

    def submit(self, command: Command) -> None:
        """Queue a command, from any thread; the next update executes it."""
        if command.name == "emergency":
            self.emergency.set()
            for call in self.on_emergency:
                call()
        self._commands.put(command)

    def add_sample(self, now: float, c: float) -> None:
        """Take the control signal at a time; NaN where there is none."""
        self._visit.signal.add(now, c)
        self.experiment.add_sample(now, c)

    def clear_signal(self) -> None:
        """Forget the signal: the condition changes, or its source is gone."""
        self._visit.signal.clear()

    def set_source_status(
        self, status: Mapping[str, Any], *, fault: str = "", moved_finger: bool = False
    ) -> None:
        """Set the status of the source, or why there is none.

        Parameters
        ----------
        status : mapping
            See :class:`ikns.experiments.conduct.signal_monitor.SignalMonitor`.
        fault : str
            Why there is no source.
        moved_finger : bool
            Whether a finger followed the source that is gone.
        """
        signal = self._visit.signal
        signal.source, signal.fault = status, fault
        signal.moved_finger = moved_finger

    def set_event_listener(
        self, call: Callable[[str, str, float], None] | None
    ) -> None:
        """Set a function to call with name, text and time (s) of each event."""
        self._visit.on_event = call

    def abort_trial(self, now: float, reason: str) -> None:
        """Abort the running trial, if any; it is repeated."""
        self._visit.abort(now, reason)

    def take_reconnect(self) -> bool:
        """Whether opening the source again was requested since the last call."""
        requested, self._reconnect = self._reconnect, False
        return requested

    def update(self, now: float) -> dict[str, Any]:
        """Let time pass, execute commands, record attempts that ended.

        Returns
        -------
        dict
            What pages show, :attr:`shown`.
        """
        self.experiment.update(now)
        self._visit.record(now)
        while True:
            try:
                command = self._commands.get_nowait()
            except Empty:
                break
            try:
                self._execute(command, now)
            except InvalidInput as error:
                self._visit.refuse(str(error), now)
            self._visit.record(now)
            self._visit.remaining = self.experiment.visit.remaining
        if self.emergency.is_set() and not self._visit.stopped:
            self._visit.stop(now)
        self._visit.advance(now)
        self._visit.recorder.retry(now)
        self._renew_plan()
        self.shown = self._snapshot(now)
        return self.shown

    def close(self, now: float, reason: str = "the run was ended") -> None:
        """Abort a running trial and make sure that everything is on disk.

        Raises
        ------
        DataLoss
            When an attempt cannot be written.
        """
        self.update(now)
        self._visit.end(now, reason)
        self._renew_plan()
        self.shown = self._snapshot(now)
        self.log.close()

    def _execute(self, command: Command, now: float) -> None:
        name, text = command.name, " ".join(command.text.split())
        reason, visit = text or "by the experimenter", self._visit
        visit.clear_message()
        if name not in COMMANDS | self.experiment.commands:
            raise InvalidInput(f"unknown command '{name}'.")
        if name == "emergency":
            self.emergency.set()
            visit.stop(now)
        elif name == "end":
            visit.end(now, "the run was ended")
        elif name in ("page_connected", "page_disconnected"):
            visit.set_page(name == "page_connected", now)
        elif visit.stopped:
            raise InvalidInput("the run was stopped; end it, then start it again.")
        elif name == "connect":
            visit.reconnect(now)
            self._reconnect = not self.on_arm  # the source is there: arm its finger
            for call in self.on_arm:
                call()
        elif name in self.experiment.commands:
            self.experiment.execute(name, text, now)
        elif name == "begin":
            visit.begin(now)
        elif name == "abort":
            if not self.experiment.state():
                raise InvalidInput("no trial is running, so there is none to abort.")
            visit.abort(now, reason)
        elif name == "skip":
            visit.skip(now, reason)
        elif name == "repeat":
            self.experiment.visit.repeat(reason)
        elif name == "rest":
            visit.start_break(now)
        elif name == "pause":
            visit.toggle_pause(now, text)

    def _renew_plan(self) -> None:
        """Replace plan and curve if an attempt ended or a trial began."""
        if self._planned != len(self.results):
            self._planned = len(self.results)
            version = self.plan["version"] + 1
            self.plan = {"version": version, "steps": plan_steps(self.experiment)}
        if self.curve["version"] != self._visit.trials_begun:
            version = self._visit.trials_begun
            self.curve = self.experiment.curve() | {"version": version}

    def _snapshot(self, now: float) -> dict[str, Any]:
        visit, trial = self._visit, self.experiment.view(now)
        state, condition = visit.name, visit.condition
        shown = {
            "time": now,
            "experiment": self.experiment.name,
            "state": state,
            "prompt": prompt(self.experiment, state),
            "condition": condition,
            "message": visit.message,
            "fault": self.log.fault or visit.signal.fault,
            "unsaved": self.log.fault,
            "attempts": self.results[-_LISTED:],
            "plan": self.plan["version"],
            "curve": self.curve["version"],
            "trial": trial,
        }
        shown |= progress_facts(self.experiment, visit.remaining)
        shown |= visit.signal.snapshot(condition)
        if visit.stopped:
            shown |= {"stopped": EMERGENCY, "can_connect": False}
        if state == "rest":
            shown["countdown"] = visit.rest_left(now)
        elif trial:
            shown["countdown"] = trial.get("countdown", 0.0)
        return shown
