"""One visit as it goes on: commands and control signals in, what screens show out.

No screen, no web, no clock. Everything but :meth:`Conductor.ask` belongs to one thread,
which calls :meth:`Conductor.frame` with what comes and :meth:`Conductor.check` all the
time; commands wait in a queue until then. Only an emergency stop does not wait.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any

from ikns.errors import InvalidInput
from ikns.experiments.conduct.experiment import COMMANDS, Command, Desk
from ikns.experiments.conduct.screen import listed, planned, prompt, step_facts
from ikns.experiments.conduct.visit_log import VisitBook

__all__ = ["Conductor"]

#: A trial that needs a control signal begins only where one came within this time, s.
_HEARD = 1.0
#: Attempts that could not be written are tried again this often, s.
_WRITE_AGAIN = 2.0
#: Attempts that the panel lists.
_LISTED = 8


class Conductor:
    """The conductor of one visit.

    Parameters
    ----------
    desk : Desk
        The experiment.
    book : VisitBook
        Where attempts go, with those of before.
    borne : collection of str
        Conditions whose signal comes from the participant's page: without the page
        their trials are aborted.
    rest : float
        Of a break that the experimenter gives, s.
    auto : float, optional
        Begin by itself after waiting so long, s, and end when all is done. Default:
        never.

    Attributes
    ----------
    shown : dict
        What screens show, plain data; another one after each check.
    results : list of dict
        What is told of each attempt.
    plan, curve : dict
        Steps, and the curve of the trial that goes on, with a ``version`` each; they
        change rarely.
    emergency : threading.Event
        Set at once by an emergency stop, in whatever thread; it stays set.
    at_emergency : list of callable
        Called then, in that thread.
    on_event : callable or None
        Called with the name and the text of what happened, and when, s.
    over : bool
        Whether the experimenter has ended it.

    Examples
    --------
    >>> import tempfile
    >>> from ikns.experiments.conduct.tracking import TrackingDesk
    >>> from ikns.experiments.tracking import schedule
    >>> about = {"experiment": "tracking", "participant": "01", "simulated": False}
    >>> desk = TrackingDesk(schedule(0, conditions=["keyboard"], training=0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     conductor = Conductor(desk, VisitBook(f"{folder}/visit", about))
    ...     conductor.frame(0.0, 0.5)
    ...     conductor.ask(Command("begin"))
    ...     for k in range(3010):
    ...         conductor.frame(k / 100, 0.5)
    ...         shown = conductor.check(k / 100)
    >>> shown["state"], shown["attempts"][0]["outcome"]
    ('waiting', 'done')
    """

    def __init__(
        self,
        desk: Desk,
        book: VisitBook,
        *,
        borne: Collection[str] = (),
        rest: float = 120.0,
        auto: float | None = None,
    ) -> None:
        self.desk, self.book = desk, book
        self.over = False
        self.emergency = Event()
        self.at_emergency: list[Callable[[], None]] = []
        self.on_event: Callable[[str, str, float], None] | None = None
        self._borne, self._rest, self._auto = frozenset(borne), rest, auto
        self._asked: SimpleQueue[Command] = SimpleQueue()
        self._written = len(book.attempts)
        self.results: list[dict[str, Any]] = [listed(row) for row in book.attempts]
        self._c = self._heard = math.nan
        self._paused, self._break_end = False, -math.inf
        self._page = False
        self._stopped = False
        self._message = ""
        self._zero = self._waiting_since = self._wrote = math.nan
        self._drive: Mapping[str, Any] = {}
        self._drive_fault = ""
        self._connect = False
        self.plan: dict[str, Any] = {"version": 0}
        self.curve: dict[str, Any] = {"version": 0}
        self.shown: dict[str, Any] = {}
        self._left: tuple[Any, ...] = desk.visit.remaining
        self._tell_plan()

    @property
    def condition(self) -> str:
        """Of the trial that goes on or comes next; empty when none does."""
        if self._stopped or self.over:
            return ""
        return next((s.condition for s in self._left if s.kind != "rest"), "")

    @property
    def state(self) -> str:
        """Stopped, finished, rest, paused or waiting, or that of the trial."""
        if self._stopped:
            return "stopped"
        if going := self.desk.state():
            return going
        if not self._left:
            return "finished"
        if self._paused:
            return "paused"
        if self._left[0].kind == "rest" or self._break_end > -math.inf:
            return "rest"
        return "waiting"

    def ask(self, command: Command) -> None:
        """Ask for something, from any thread; it is done at the next check."""
        if command.name == "emergency":
            self.emergency.set()
            for call in self.at_emergency:
                call()
        self._asked.put(command)

    def frame(self, now: float, c: float) -> None:
        """Take the control signal at a time; NaN where there is none."""
        self._c = c
        if math.isfinite(c):
            self._heard = now
        self.desk.frame(now, c)

    def quiet(self) -> None:
        """Forget the signal: another condition comes, or its source has gone."""
        self._c = self._heard = math.nan

    def driven(self, facts: Mapping[str, Any], *, fault: str = "") -> None:
        """Tell how what makes the signal is doing, and what keeps it from doing so."""
        self._drive, self._drive_fault = facts, fault

    def break_off(self, now: float, reason: str) -> None:
        """Abort the trial that goes on, if any: it comes again."""
        if self.desk.state():
            self.desk.abort(now, reason)
            self._message = f"The trial was aborted: {reason}."

    def connect_again(self) -> bool:
        """Whether somebody asked since to open what makes the signal once more."""
        asked, self._connect = self._connect, False
        return asked

    def check(self, now: float) -> dict[str, Any]:
        """Do what was asked, let time pass, write down what ended.

        Returns
        -------
        dict
            What screens show, :attr:`shown`.
        """
        if math.isnan(self._zero):
            self._zero = self._wrote = now
        self.desk.check(now)
        self._settle(now)
        while True:
            try:
                command = self._asked.get_nowait()
            except Empty:
                break
            try:
                self._do(command, now)
            except InvalidInput as error:
                self._message = str(error)
            self._settle(now)
            self._left = self.desk.visit.remaining
        if self.emergency.is_set() and not self._stopped:
            self._stop(now)
        self._pass_time(now)
        if self.book.fault and now - self._wrote >= _WRITE_AGAIN:
            self._wrote = now
            self.book.write()
        self.shown = self._snapshot(now)
        return self.shown

    def close(self, now: float, reason: str = "the run was ended") -> None:
        """End: a trial that goes on is aborted, and everything is on disk.

        Raises
        ------
        FileError
            When an attempt cannot be written.
        """
        self.check(now)
        self.break_off(now, reason)
        self._settle(now)
        self.over = True
        self.shown = self._snapshot(now)
        self.book.close()

    # --- what is asked --------------------------------------------------------------

    def _do(self, command: Command, now: float) -> None:
        name, text = command.name, " ".join(command.text.split())
        self._message = ""
        if name in self.desk.commands:
            if self._stopped:
                raise InvalidInput("the run was stopped; end it and start it again.")
            self.desk.ask(name, text, now)
        elif name not in COMMANDS:
            raise InvalidInput(f"expected a command that is known, found '{name}'.")
        elif name == "emergency":
            self._stop(now)
        elif name == "end":
            self._end(now)
        elif name in ("came", "left"):
            self._page_is(name == "came", now)
        elif name == "connect":
            self._connect = True
        elif self._stopped:
            raise InvalidInput("the run was stopped; end it and start it again.")
        elif name == "begin":
            self._begin(now)
        elif name == "abort":
            if not self.desk.state():
                raise InvalidInput("expected a trial to abort, found none going on.")
            self.break_off(now, text or "by the experimenter")
        elif name == "skip":
            self._skip(now, text)
        elif name == "repeat":
            self.desk.visit.repeat(text or "by the experimenter")
        elif name == "rest":
            self._give_break(now)
        elif name == "pause":
            self._paused = not self._paused
            self._event("pause" if self._paused else "pause over", text, now)

    def _begin(self, now: float) -> None:
        if self._paused:
            raise InvalidInput("expected no pause, found one: end it to begin.")
        if self._break_end > -math.inf:
            raise InvalidInput("expected no break, found one: skip it to begin.")
        step = self.desk.visit.current
        if step is not None and step.kind != "rest" and self.desk.needs_signal:
            borne = step.condition in self._borne
            if not now - self._heard <= _HEARD or (borne and not self._page):
                raise InvalidInput(
                    f"expected a control signal of {step.condition}, found none"
                    f"{_where(step.condition, self._borne, page=self._page)}."
                )
        self.desk.begin(now)
        self._event("trial begins", self.desk.visit.current.key, now)
        self.curve = self.desk.curve() | {"version": self.curve["version"] + 1}

    def _skip(self, now: float, reason: str) -> None:
        if self._break_end > -math.inf and not self.desk.state():
            self._break_end = -math.inf
        elif self.desk.visit.current is None:
            raise InvalidInput("expected a step to skip, found none left.")
        else:
            self.desk.skip(now, reason or "by the experimenter")

    def _give_break(self, now: float) -> None:
        if self.desk.state():
            raise InvalidInput("expected no trial going on, found one: abort it.")
        step = self.desk.visit.current
        if step is None or step.kind == "rest" or self._break_end > -math.inf:
            raise InvalidInput("expected a trial to come next, found a rest or none.")
        self._break_end = now + self._rest
        self._event("break", f"{self._rest:g} s", now)

    def _page_is(self, there: bool, now: float) -> None:
        self._page = there
        going = self.desk.state()
        words = "came" if there else "left"
        self._event(f"page {words}", self.condition, now)
        if not there and going and self.condition in self._borne:
            self.break_off(now, "the participant's page was closed")

    def _stop(self, now: float) -> None:
        if self._stopped:
            return
        self.emergency.set()
        self.break_off(now, "emergency stop")
        self._settle(now)
        self._stopped = True
        self._event("emergency stop", "", now)
        self._message = "Stopped. End the run; started again it goes on from here."

    def _end(self, now: float) -> None:
        self.break_off(now, "the run was ended")
        self._settle(now)
        self.over = True

    # --- what happens by itself -----------------------------------------------------

    def _pass_time(self, now: float) -> None:
        if self._stopped or self.desk.state():
            self._waiting_since = math.nan
            return
        if self._left and self._left[0].kind == "rest":
            self.desk.visit.rest(now)
            self._left = self.desk.visit.remaining
        if now >= self._break_end:
            self._break_end = -math.inf
        if self.state != "waiting":
            self._waiting_since = math.nan
            self.over |= self._auto is not None and self.state == "finished"
        elif math.isnan(self._waiting_since):
            self._waiting_since = now
        elif self._auto is not None and now - self._waiting_since >= self._auto:
            self._waiting_since = now
            try:
                self._begin(now)
            except InvalidInput as error:
                self._message = str(error)

    def _settle(self, now: float) -> None:
        """Write down attempts that are new."""
        attempts = self.desk.visit.attempts
        if self._written == len(attempts):
            return
        while self._written < len(attempts):
            attempt = attempts[self._written]
            self._written += 1
            row = self.desk.row(
                self._written, attempt, practised=self._practised(attempt.key)
            )
            self.book.put(row)
            self.results.append(listed(row) | self.desk.result(attempt))
            self._event(
                "trial ends", f"{self._written} {attempt.key} {attempt.outcome}", now
            )
            # Kept on disk, not in memory.
            attempts[self._written - 1] = attempt._replace(record=None)
        self._wrote = now
        self._left = self.desk.visit.remaining
        self._tell_plan()

    def _practised(self, key: str) -> int:
        """Trials that went to their end in the condition of a step so far."""
        condition = key.partition("/")[0]
        over = ("done", "success", "dropped", "timeout")
        return sum(
            row["condition"] == condition and row["outcome"] in over
            for row in self.book.attempts
        )

    def _event(self, name: str, text: str, now: float) -> None:
        zero = 0.0 if math.isnan(self._zero) else self._zero
        self.book.note(name, text, time=now - zero)
        if self.on_event:
            self.on_event(name, text, now)

    # --- what screens show ----------------------------------------------------------

    def _tell_plan(self) -> None:
        version = self.plan["version"] + 1
        self.plan = {"version": version, "steps": planned(self.desk)}

    def _snapshot(self, now: float) -> dict[str, Any]:
        visit, state = self.desk.visit, self.state
        step = self._left[0] if self._left else None
        view = self.desk.view(now)
        shown = {
            "experiment": self.desk.experiment,
            "state": state,
            "prompt": prompt(self.desk, state),
            "step": None if step is None else step_facts(self.desk, step),
            "at": next((i for i, s in enumerate(visit.steps) if s is step), None),
            "trials": sum(s.kind != "rest" for s in visit.steps),
            "left": sum(s.kind != "rest" for s in self._left),
            "c": self._c,
            "condition": self.condition,
            "borne": self.condition in self._borne,
            "page": self._page,
            "message": self._message,
            "fault": self.book.fault or self._drive_fault,
            "can_connect": bool(
                self._drive_fault or self._drive.get("state") == "safe"
            ),
            "drive": dict(self._drive),
            "attempts": self.results[-_LISTED:],
            "plan": self.plan["version"],
            "curve": self.curve["version"],
            "trial": view,
        }
        if state == "rest":
            ends = self._break_end - now
            shown["countdown"] = ends if math.isfinite(ends) else visit.rest(now)
        elif view:
            shown["countdown"] = view.get("countdown", 0.0)
        return shown


def _where(condition: str, borne: Collection[str], *, page: bool) -> str:
    """Say where a signal that does not come would come from."""
    if condition not in borne:
        return ": see what its source says"
    if not page:
        return ": open the participant's page"
    return (
        ": press a button of the gamepad on the participant's page"
        if condition == "gamepad"
        else ": bring the participant's page to the front"
    )
