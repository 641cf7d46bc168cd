"""A finger driven by a push button, the condition "ring", in a thread of its own."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from queue import Empty, SimpleQueue
from typing import Any

from ikns.errors import IknsError
from ikns.experiments.conduct.inputs import Sample, SampleQueue
from ikns.experiments.conduct.measured import recent_values
from ikns.finger import Finger
from ikns.finger.inputs import RingButton

#: How often the finger gets a command, 1/s.
_RATE = 100.0


class RingDriver:
    """A button and its finger.

    Parameters
    ----------
    presses : queue
        Gets an item for each press of the button, from any thread.
    finger : Finger or None

    Attributes
    ----------
    fault : str
        Why it has ended; empty while it runs.
    """

    def __init__(self, presses: SimpleQueue[None], finger: Finger | None) -> None:
        self.fault = ""
        self._presses, self._finger = presses, finger
        self._samples = SampleQueue()
        self._status: dict[str, Any] = {}
        self._measured_at = math.nan
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ring", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop, which relaxes the finger, and wait until that is done."""
        self.halt()
        self._thread.join()

    def halt(self) -> None:
        """Stop within one period."""
        self._stop.set()

    def arm(self) -> None:
        """Do nothing: once the finger is safe this has ended, and is connected anew."""

    def take(self, now: float) -> list[Sample]:
        """Return the commands to the finger since the last call."""
        return self._samples.take(now)

    def status(self) -> dict[str, Any]:
        """Return the state of the finger."""
        shown: dict[str, Any] = {"kind": "ring"}
        if self._status:
            age = time.monotonic() - self._measured_at
            shown |= recent_values((self._status, age))
        return shown

    def log_event(self, name: str, text: str, now: float) -> None:
        """Do nothing: nothing is recorded here."""

    def _run(self) -> None:
        try:
            with ExitStack() as stack:
                if self._finger is not None:
                    stack.enter_context(self._finger)
                self._drive()
        except (IknsError, OSError) as error:
            self.fault = str(error)
        finally:
            if not self._stop.is_set():
                self.fault = self.fault or "the ring button is no longer read."

    def _drive(self) -> None:
        while not self._presses.empty():  # presses before the start do not count
            self._presses.get()
        ring = RingButton()
        due = time.monotonic()
        while not self._stop.is_set():
            try:
                while True:
                    self._presses.get_nowait()
                    ring.press()
            except Empty:
                pass
            now, c = ring()
            if self._finger is not None:
                self._finger.command(c)
                state = self._finger.state()
                if state.mode == "safe":
                    self.fault = f"{state.alert or 'no reason is known'}."
                    return
                self._status = {
                    "finger": state.mode,
                    "flexion": c,
                    "measured": state.flexion,
                }
                self._measured_at = now - state.age
            self._samples.put(Sample(now, c))
            due = max(due + 1 / _RATE, time.monotonic())
            self._stop.wait(due - time.monotonic())


@contextmanager
def ring_driver(
    presses: SimpleQueue[None], finger: Callable[[], Finger] | None = None
) -> Iterator[RingDriver]:
    """Let a button drive a finger while the context is open.

    Parameters
    ----------
    presses : queue
        See :class:`RingDriver`.
    finger : callable, optional
        Makes the finger; without it nothing moves.
    """
    driver = RingDriver(presses, finger() if finger else None)
    try:
        yield driver
    finally:
        driver.end()
