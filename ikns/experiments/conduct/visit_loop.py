"""A visit and the clock: what drives each condition is opened, asked and closed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from threading import Event
from typing import Any

from ikns.errors import IknsError, InvalidInput
from ikns.experiments.conduct.conductor import Conductor
from ikns.experiments.conduct.inputs import Driver

__all__ = ["carry_out"]


def carry_out(
    conductor: Conductor,
    drivers: Mapping[str, Callable[[], AbstractContextManager[Driver]]],
    *,
    stop: Event,
    rate: float = 100.0,
) -> None:
    """Go through a visit until it is ended or stopped; then everything is on disk.

    Parameters
    ----------
    conductor : Conductor
    drivers : mapping of condition to callable
        Each opens what makes the signal of the condition. It is open from the first
        trial of the condition that is due to the last, and closed before another is
        opened.
    stop : threading.Event
        Set it to end: the trial that goes on is aborted and comes again.
    rate : float
        How often a signal that holds is looked at, 1/s.

    Raises
    ------
    InvalidInput
        When the rate is not positive, or nothing drives a condition.
    FileError
        When attempts could not be written.
    """
    if not 0 < rate <= 1000:
        raise InvalidInput(f"expected a rate from 0 to 1000 Hz, found {rate:g}.")
    conditions = {s.condition for s in conductor.desk.visit.steps if s.condition}
    missing = sorted(conditions - set(drivers))
    if missing:
        raise InvalidInput(f"expected something to drive '{missing[0]}', found none.")
    line = _Line(conductor, drivers)
    due = time.monotonic()
    try:
        while not (stop.is_set() or conductor.over):
            line.tick(time.monotonic())
            # A tick that was late is not made up for.
            due = max(due + 1 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
    finally:
        try:
            conductor.close(time.monotonic())
        finally:
            line.close()


class _Line:
    """What drives the present condition."""

    def __init__(
        self,
        conductor: Conductor,
        drivers: Mapping[str, Callable[[], AbstractContextManager[Driver]]],
    ) -> None:
        self._conductor, self._drivers = conductor, drivers
        self._condition = ""
        self._context: AbstractContextManager[Driver] | None = None
        self._driver: Driver | None = None
        self._fault = ""

    def tick(self, now: float) -> None:
        """Change what drives if need be, and pass on what came."""
        conductor, wanted = self._conductor, self._conductor.condition
        if wanted != self._condition or conductor.connect_again():
            self.close()
            conductor.quiet()
            self._condition = wanted
            self._open(wanted)
        facts: Mapping[str, Any] = {}
        if self._driver is not None:
            for at, c in self._driver.take(now):
                conductor.frame(at, c)
            facts, fault = self._driver.facts(), self._driver.fault
            if fault:
                self.close()
                conductor.quiet()
                conductor.break_off(now, fault.rstrip("."))
                self._fault = fault
        conductor.driven(facts, fault=self._fault)
        conductor.check(time.monotonic())

    def close(self) -> None:
        """Let go of it."""
        context, self._context, self._driver = self._context, None, None
        self._conductor.at_emergency = []
        self._conductor.on_event = None
        if context is not None:
            context.__exit__(None, None, None)

    def _open(self, condition: str) -> None:
        self._fault = ""
        if not condition:
            return
        context = self._drivers[condition]()
        try:
            self._driver = context.__enter__()
            self._context = context
            self._conductor.at_emergency = [self._driver.halt]
            self._conductor.on_event = self._driver.mark
        except (IknsError, OSError) as error:
            self._fault = str(error)
