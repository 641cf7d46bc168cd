"""A finger that another program moves: limited and watched here, driven there."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Self

from ikns.errors import InvalidInput
from ikns.finger.guard import Guard, Safety
from ikns.finger.state import FingerState


class RelayFinger:
    """A finger without a device, whose flexion another program hands on.

    Range, rate, acceleration and the command timeout are those of every finger. Nothing
    is measured, so it is taken to be where it was sent, and it has no torque to switch
    off: its safe state is ``hold`` or ``open``.

    Parameters
    ----------
    safety : Safety, optional
        Holds by default.
    flexion : float
        Where it starts.
    clock : callable
        Seconds, monotonic.

    Examples
    --------
    >>> now = 0.0
    >>> finger = RelayFinger(clock=lambda: now)
    >>> finger.connect()
    >>> now = 0.1
    >>> finger.command(1.0)
    0.2
    >>> now = 1.0
    >>> finger.latest(), finger.state().alert
    (0.2, 'no command for 0.5 s')
    """

    resolution = 0.0

    def __init__(
        self,
        *,
        safety: Safety | None = None,
        flexion: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.safety = Safety(safe_state="hold") if safety is None else safety
        if self.safety.safe_state == "limp":
            raise InvalidInput(
                "expected the safe state hold or open, found limp: another program has "
                "the device, and an action cannot switch its torque off."
            )
        self._guard, self._clock = Guard(self.safety), clock
        self._latest = flexion
        self._lock = threading.Lock()

    def connect(self) -> None:
        """Follow commands from the latest flexion; leave the safe state."""
        with self._lock:
            self._guard.start(self._clock(), self._latest)

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one to hand on, NaN if it is not connected."""
        with self._lock:
            now = self._clock()
            sent = self._guard.command(now, flexion)
            self._keep(now)
            return sent

    def latest(self) -> float:
        """Return the flexion to hand on now; the last one once it is relaxed."""
        with self._lock:
            now = self._clock()
            self._guard.tick(now)
            self._keep(now)
            return self._latest

    def state(self) -> FingerState:
        """Return the present state."""
        with self._lock:
            now = self._clock()
            self._guard.tick(now)
            self._keep(now)
            return FingerState(
                time=now,
                age=0.0,
                mode=self._guard.mode,
                flexion=self._latest,
                sent=self._guard.goal,
                alert=self._guard.reason,
            )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay in it until connected again."""
        with self._lock:
            self._guard.fail(reason)

    def relax(self) -> None:
        """Ignore further commands; harmless when repeated."""
        with self._lock:
            self._guard.relax()

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        """Relax."""
        self.relax()

    def _keep(self, now: float) -> None:
        if self._guard.torque:
            self._latest = self._guard.goal
            self._guard.measured(now, self._latest)
