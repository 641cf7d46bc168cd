"""Runs a visit in real time, with the source of each condition's control signal."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from threading import Event
from typing import Any

from ikns.errors import IknsError, InvalidInput
from ikns.experiments.conduct.conductor import Conductor
from ikns.experiments.conduct.inputs import Driver

Drivers = Mapping[str, Callable[[], AbstractContextManager[Driver]]]


def run_visit(
    conductor: Conductor, drivers: Drivers, *, stop: Event, rate: float = 100.0
) -> None:
    """Run a visit until it is ended or stopped; then everything is on disk.

    Parameters
    ----------
    conductor : Conductor
    drivers : mapping of condition to callable
        Each opens the source of the condition's signal. It stays open while trials of
        the condition follow one another, and is closed before another is opened.
    stop : threading.Event
        Set it to end: a running trial is aborted and repeated later.
    rate : float
        How often samples are taken and the visit is updated, 1/s.

    Raises
    ------
    InvalidInput
        When the rate is not positive, or a condition has no source.
    DataLoss
        When attempts could not be written.
    """
    if not 0 < rate <= 1000:
        raise InvalidInput(f"expected a rate from 0 to 1000 Hz, found {rate:g}.")
    conditions = {s.condition for s in conductor.experiment.visit.steps if s.condition}
    missing = sorted(conditions - set(drivers))
    if missing:
        raise InvalidInput(
            f"expected a source of control signals for '{missing[0]}', found none."
        )
    source = _CurrentSource(conductor, drivers)
    due = time.monotonic()
    try:
        while not (stop.is_set() or conductor.over):
            source.update(time.monotonic())
            # A late update is not made up for.
            due = max(due + 1 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
    finally:
        source.halt()  # nothing moves while files are written
        try:
            conductor.close(time.monotonic())
        finally:
            source.close()


class _CurrentSource:
    """The source of the current condition's signal."""

    def __init__(self, conductor: Conductor, drivers: Drivers) -> None:
        self._conductor, self._drivers = conductor, drivers
        self._condition = ""
        self._context: AbstractContextManager[Driver] | None = None
        self._driver: Driver | None = None
        self._fault = ""
        self._moved_finger = False

    def update(self, now: float) -> None:
        """Change the source if the condition changed, and pass its samples on."""
        conductor, wanted = self._conductor, self._conductor.condition
        reconnect = conductor.take_reconnect()
        if wanted != self._condition or reconnect:
            self.close()
            conductor.clear_signal()
            self._condition = wanted
            self._open(wanted)
        status: Mapping[str, Any] = {}
        if self._driver is not None:
            for at, c in self._driver.take(now):
                conductor.add_sample(at, c)
            status, fault = self._driver.status(), self._driver.fault
            if fault:
                self._moved_finger = bool(status.get("finger"))
                status = {}
                self.close()
                conductor.clear_signal()
                conductor.abort_trial(now, fault.rstrip("."))
                self._fault = fault
        conductor.set_source_status(
            status, fault=self._fault, moved_finger=self._moved_finger
        )
        conductor.update(time.monotonic())

    def halt(self) -> None:
        """Stop all motion at once."""
        if self._driver is not None:
            self._driver.halt()

    def close(self) -> None:
        """Close the source."""
        context, self._context, self._driver = self._context, None, None
        self._conductor.on_emergency = self._conductor.on_arm = []
        self._conductor.set_event_listener(None)
        if context is not None:
            context.__exit__(None, None, None)

    def _open(self, condition: str) -> None:
        self._fault, self._moved_finger = "", False
        if not condition:
            return
        context = self._drivers[condition]()
        try:
            self._driver = context.__enter__()
            self._context = context
            self._conductor.on_emergency = [self._driver.halt]
            self._conductor.on_arm = [self._driver.arm]
            self._conductor.set_event_listener(self._driver.log_event)
        except (IknsError, OSError) as error:
            self._fault = str(error)
