"""Fingers that are worn together: what stops one stops all."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Self

from ikns.endings import ending_requested, exit_on_signals
from ikns.errors import InvalidInput
from ikns.finger.attempt import relax_after
from ikns.finger.state import Finger, FingerState

#: While one connects, those that are connected already are told to hold this often, s.
_HOLD_EVERY = 0.02


class FingerGroup:
    """Fingers that each follow a freedom of their own, and are safe together.

    Each keeps its own limits, time-outs and safe state. One that goes to its safe
    state, for whatever reason, brings all others into theirs, and one that cannot be
    connected leaves none connected.

    Parameters
    ----------
    fingers : sequence of Finger
        Not connected yet.
    dofs : sequence of int, optional
        Which freedom of the map drives each, from 1 on; by default one after the other.

    Attributes
    ----------
    fingers : tuple of Finger
    dofs : tuple of int

    Examples
    --------
    >>> from ikns.finger import SimulatedFinger
    >>> now = 0.0
    >>> pair = [SimulatedFinger(clock=lambda: now) for _ in range(2)]
    >>> with FingerGroup(pair, dofs=(1, 2)) as group:
    ...     for _ in range(100):
    ...         now += 0.01
    ...         sent = group.command([1.0, 0.25])
    ...     pair[0].make_safe("its tendon is slack")
    ...     states = group.states()
    >>> sent
    [1.0, 0.25]
    >>> states[1].mode, states[1].alert
    ('safe', 'finger 1 stopped: its tendon is slack')
    """

    def __init__(
        self, fingers: Sequence[Finger], dofs: Sequence[int] | None = None
    ) -> None:
        self.fingers = tuple(fingers)
        count = len(self.fingers)
        self.dofs = tuple(range(1, count + 1) if dofs is None else dofs)
        self._passed_on = ""
        if not count or len(self.dofs) != count:
            raise InvalidInput(
                "expected a degree of freedom for each finger, found "
                f"{len(self.dofs)} for {count} fingers."
            )
        if min(self.dofs) < 1 or len(set(self.dofs)) < count:
            raise InvalidInput(
                "expected different degrees of freedom, counted from 1, found "
                f"{', '.join(map(str, self.dofs))}."
            )

    def connect(self) -> None:
        """Connect every finger; where one fails, make safe those that were connected.

        Raises
        ------
        FingerError
        """
        exit_on_signals()
        self._passed_on = ""
        ready: list[Finger] = []
        try:
            with _held(ready, alone=len(self.fingers) == 1):
                for finger in self.fingers:
                    finger.connect()
                    ready.append(finger)
        except BaseException:
            for finger in ready:
                finger.make_safe("another finger could not be connected")
            raise

    def command(self, flexions: Sequence[float]) -> list[float]:
        """Request a flexion of each; return those sent. See :meth:`Finger.command`."""
        if len(self.fingers) == 1:
            return [self.fingers[0].command(*flexions)]
        sent = [
            finger.command(flexion)
            for finger, flexion in zip(self.fingers, flexions, strict=True)
        ]
        self.states()
        return sent

    def states(self) -> list[FingerState]:
        """Return the latest known state of each, once what stops one has stopped all.

        Never blocks, never raises.
        """
        if len(self.fingers) == 1:
            return [self.fingers[0].state()]
        states = [finger.state() for finger in self.fingers]
        if ending_requested():  # then each relaxes by itself
            return states
        still = [k for k, state in enumerate(states) if state.mode != "active"]
        if len(still) in (0, len(states)):
            return states
        stopped = still[0]
        why = states[stopped].alert or "no reason is known"
        self._passed_on = f"finger {self.dofs[stopped]} stopped: {why}"
        self.make_safe(self._passed_on)
        return [finger.state() for finger in self.fingers]

    def state(self) -> FingerState:
        """Return the state of the first finger, with the mode and alerts of all.

        Its mode is ``"safe"`` when one is.
        """
        states = self.states()
        if len(states) == 1:
            return states[0]
        modes = {state.mode for state in states}
        mode = next(m for m in ("safe", "relaxed", "active") if m in modes)
        return replace(states[0], mode=mode, alert=self.alert(states))

    def alert(self, states: Sequence[FingerState]) -> str:
        """Return why the fingers are in their safe state, and alerts of the devices.

        Where they differ each has its number, and what only passes on the reason of
        another is left out.

        Parameters
        ----------
        states : sequence of FingerState
            Of each finger.
        """
        if len(states) == 1:
            return states[0].alert
        alerts = [state.alert for state in states]
        if len(set(alerts)) == 1:
            return alerts[0]
        parts = [
            (dof, alert.removeprefix(self._passed_on).removeprefix("; "))
            for dof, alert in zip(self.dofs, alerts, strict=True)
        ]
        return "; ".join(f"finger {dof}: {alert}" for dof, alert in parts if alert)

    def make_safe(self, reason: str) -> None:
        """Bring every finger into its safe state until connected again."""
        for finger in self.fingers:
            finger.make_safe(reason)

    def relax(self) -> None:
        """Switch every torque off, all at the same time, and disconnect.

        Raises
        ------
        FingerError
            Of the first finger that fails, with the others' as notes; all are tried.
        """
        errors: list[Exception] = []

        def attempt(finger: Finger) -> None:
            try:
                finger.relax()
            except Exception as error:  # whatever it is, the others need to go on
                errors.append(error)

        # A servo that does not confirm takes a second, which no other may wait for.
        threads = [
            threading.Thread(target=attempt, args=(finger,), name="relax a finger")
            for finger in self.fingers[1:]
        ]
        for thread in threads:
            thread.start()
        attempt(self.fingers[0])
        for thread in threads:
            thread.join()
        for error in errors[1:]:
            errors[0].add_note(str(error))
        if errors:
            raise errors[0]

    def __enter__(self) -> Self:
        """Connect; relax all where one fails."""
        try:
            self.connect()
        except BaseException as error:
            relax_after(self.relax, error)
            raise
        return self

    def __exit__(self, *exception: object) -> None:
        """Relax; a failure is added as a note to an exception already raised."""
        relax_after(self.relax, exception[1])


@contextmanager
def _held(ready: list[Finger], *, alone: bool) -> Iterator[None]:
    """Keep the fingers of a growing list where they are while others connect."""
    if alone:
        yield
        return
    stop = threading.Event()

    def hold() -> None:
        while not stop.wait(_HOLD_EVERY):
            for finger in tuple(ready):
                finger.command(math.nan)

    thread = threading.Thread(target=hold, daemon=True, name="hold fingers")
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
