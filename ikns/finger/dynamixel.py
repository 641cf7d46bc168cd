"""A finger whose tendon is pulled by a Dynamixel servo."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Self

from ikns.errors import InvalidInput
from ikns.finger.bus import Bus
from ikns.finger.configuration import ServoConfiguration
from ikns.finger.drive import Drive
from ikns.finger.errors import FingerError
from ikns.finger.guard import Guard, Safety
from ikns.finger.models import model_named
from ikns.finger.relax_at_exit import forget, relax_at_exit
from ikns.finger.state import FingerState

__all__ = ["DynamixelFinger"]

#: Time that a servo has for giving up its torque, seconds; then relaxing fails.
_RELAX_TIMEOUT = 1.0
#: How often to say the same while connecting: noise may spoil a packet, not five.
_TRIES = 5


class DynamixelFinger:
    """A finger driven by one Dynamixel servo in position control.

    A thread of its own talks to the servo, so that a silent bus (35 ms for every
    question without answer) never holds up the caller. It goes on telling the servo the
    last goal; the servo stops by itself when it hears nothing for `watchdog` seconds
    (models with Protocol 2.0; an AX-12 has no watchdog and keeps its last goal, which
    is never further away than one step of the limiter).

    Parameters
    ----------
    port : str
        Serial port.
    id, baud : int
    model : str
        One of :data:`ikns.finger.models.MODELS`.
    open_ticks, closed_ticks : int, optional
        Positions of the servo at flexion 0 and 1; a quarter turn before and after the
        middle by default. Either may be the larger.
    effort : float
        Share of the servo's full current (of its full voltage where it measures no
        current) that it may push with.
    safety : Safety, optional
        Limits, time-outs and the safe state.
    watchdog : float
        Seconds; in steps of 0.02 up to 2.54.
    rate : float
        Times per second to talk to the servo, at most.

    Examples
    --------
    >>> from ikns.finger.emulator import Servo, Wire  # a simulated servo
    >>> import time
    >>> with Wire(Servo("xl430")) as wire, DynamixelFinger(wire.port) as finger:
    ...     for _ in range(100):
    ...         sent = finger.command(1.0)
    ...         time.sleep(0.01)
    >>> sent  # half a second more than limits need from the middle
    1.0
    """

    def __init__(
        self,
        port: str,
        *,
        id: int = 1,
        baud: int = 57600,
        model: str = "xl430",
        open_ticks: int | None = None,
        closed_ticks: int | None = None,
        effort: float = 0.5,
        safety: Safety | None = None,
        watchdog: float = 0.3,
        rate: float = 100.0,
    ) -> None:
        self._model = model_named(model)
        number = self._model["id"]
        if not number.lower <= id <= number.upper:
            raise InvalidInput(
                f"a servo's id must be {number.lower} to {number.upper}, not {id}."
            )
        if not 0 < effort <= 1:
            raise InvalidInput(f"effort must be in (0, 1], not {effort:g}.")
        if not 0.02 <= watchdog <= 2.54:
            raise InvalidInput(f"watchdog must be 0.02 to 2.54 s, not {watchdog:g}.")
        if not 0 < rate < math.inf:
            raise InvalidInput(f"rate must be positive and finite, not {rate:g}.")
        middle = (self._model.highest + 1) / 2
        quarter = self._model.ticks_per_turn / 4
        span = (
            round(middle - quarter) if open_ticks is None else open_ticks,
            round(middle + quarter) if closed_ticks is None else closed_ticks,
        )
        if not all(0 <= t <= self._model.highest for t in span) or span[0] == span[1]:
            raise InvalidInput(
                f"open and closed must be two positions from 0 to "
                f"{self._model.highest} ticks, not {span[0]} and {span[1]}."
            )
        self.safety = Safety() if safety is None else safety
        self.resolution = 1.0 / abs(span[1] - span[0])
        self._configuration = ServoConfiguration(
            *span, effort, watchdog, self.safety.limits
        )
        self._bus = Bus(port, id=id, baud=baud, model=self._model)
        self._period = 1.0 / rate
        self._lock = threading.RLock()
        self._guard = Guard(self.safety)
        self._drive = Drive(self._bus, self._configuration, self._guard, self._lock)
        self._thread: threading.Thread | None = None
        self._held = False
        self._stop = threading.Event()

    def connect(self) -> None:
        """Take hold of the servo, from where it is; also leave the safe state.

        Checks who is there, writes limits into the servo, and only then switches its
        torque on, with its present position as its goal.

        Raises
        ------
        FingerError
            When the port is absent or busy, or the servo does not answer, is another
            one, or complains of something.
        """
        self._halt()
        with self._lock:
            self._guard.relax()
        self._bus.close()
        self._bus.open()
        self._bus.tries = _TRIES  # nothing depends on time yet
        checked = False
        try:
            self._bus.check()  # whoever else is there stays untouched
            checked = self._held = True
            relax_at_exit(self)
            self._drive.set_up()
            self._drive.arm()
        except BaseException:
            if checked:
                self._let_go()
            self._bus.close()
            raise
        finally:
            self._bus.tries = 1
        self._stop.clear()
        self._thread = threading.Thread(
            target=self._run, daemon=True, name=f"finger on {self._bus.port}"
        )
        self._thread.start()

    def command(self, flexion: float) -> float:
        """Ask for a flexion; return what is sent, NaN if nothing is."""
        with self._lock:
            return self._configuration.sent(
                self._guard.command(time.monotonic(), flexion)
            )

    def state(self) -> FingerState:
        """Return the last that is known."""
        with self._lock:
            known, guard = self._drive.known, self._guard
            return replace(
                known,
                age=time.monotonic() - known.time,
                mode=guard.mode,
                sent=self._configuration.sent(guard.goal),
                stalled=guard.stalled,
                alert=guard.reason or self._drive.alert,
            )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay there until connected again."""
        with self._lock:
            self._guard.fail(reason)

    def relax(self) -> None:
        """Switch the torque off, see that it is off, and close the port.

        Raises
        ------
        FingerError
            When the servo does not confirm that its torque is off. The port is closed
            all the same.
        """
        if not self._held:
            return
        self._halt()
        if not self._let_go():
            watchdog = "bus_watchdog" in self._model
            raise FingerError(
                f"{self._bus.port}: servo {self._bus.id} did not confirm that its "
                "torque is off, cut its power"
                + (" (its own watchdog stops it)." if watchdog else ".")
            )

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        """Relax; an exception on its way is not hidden by one from here."""
        try:
            self.relax()
        except FingerError as error:
            if not isinstance(exception[1], BaseException):
                raise
            exception[1].add_note(str(error))

    def _let_go(self) -> bool:
        """Torque off and port closed; one that is interrupted is repeated at exit."""
        confirmed = self._drive.let_go(_RELAX_TIMEOUT)
        self._bus.close()
        self._held = False
        forget(self)
        return confirmed

    def _halt(self) -> None:
        """End the thread; the bus is then free for the caller."""
        thread = self._thread
        if thread is not None:
            self._stop.set()
            thread.join()
            self._thread = None

    def _run(self) -> None:
        due = time.monotonic()
        try:
            while not self._stop.is_set():
                self._drive.cycle()
                due = max(due + self._period, time.monotonic())
                self._stop.wait(max(due - time.monotonic(), 0.0))
        except BaseException as error:  # the servo's watchdog now stops it
            self.make_safe(f"talking to the servo ended with {error!r}")
            raise
