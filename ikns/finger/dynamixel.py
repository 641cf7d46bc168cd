"""A finger whose tendon is driven by a Dynamixel servo."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Self

from ikns.endings import ending_requested
from ikns.errors import InvalidInput
from ikns.finger.attempt import ConnectionAttempt, relax_after
from ikns.finger.bus import Bus
from ikns.finger.configuration import ServoConfiguration
from ikns.finger.drive import Drive
from ikns.finger.errors import FingerError
from ikns.finger.guard import Guard, Safety
from ikns.finger.models import model_named
from ikns.finger.relax_at_exit import forget, not_relaxed, relax_at_exit
from ikns.finger.state import FingerState

#: Timeout for switching the torque off, s.
_RELAX_TIMEOUT = 1.0
#: Attempts per instruction while connecting: noise may damage a packet, but not five.
_TRIES = 5


class DynamixelFinger:
    """A finger driven by one Dynamixel servo in position control.

    A dedicated thread talks to the servo, so that a silent bus (35 ms for every
    instruction without a response) never blocks the caller. It keeps sending the last
    goal, and the servo stops by itself when it receives nothing for `watchdog` seconds
    (models with Protocol 2.0; an AX-12 has no watchdog and keeps its last goal, which
    is never farther away than one step of the limiter).

    Parameters
    ----------
    port : str
        Serial port.
    id, baud : int
    model : str
        One of :data:`ikns.finger.models.MODELS`.
    open_ticks, closed_ticks : int, optional
        Positions of the servo at flexion 0 and 1, in either order; by default a quarter
        turn before and after the center.
    effort : float
        Share of the servo's full current that it may use, or of its full voltage where
        it measures no current.
    safety : Safety, optional
        Limits, timeouts and the safe state.
    watchdog : float
        Seconds, in steps of 0.02 up to 2.54.
    rate : float
        Most cycles per second of writing the goal and reading the state.

    Examples
    --------
    >>> from ikns.finger.emulator import Servo, Wire  # a simulated servo
    >>> import time
    >>> with Wire(Servo("xl430")) as wire, DynamixelFinger(wire.port) as finger:
    ...     for _ in range(100):
    ...         sent = finger.command(1.0)
    ...         time.sleep(0.01)
    >>> sent  # the limits need half a second from the center
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
        self.port, self.id = port, id
        #: Baud rate and protocol, which all servos of a port share.
        self.speech = baud, self._model.protocol
        self.resolution = 1.0 / abs(span[1] - span[0])
        self._configuration = ServoConfiguration(
            *span, effort, watchdog, self.safety.limits
        )
        self._bus = Bus(port, id=id, baud=baud, model=self._model)
        self._period = 1.0 / rate
        self._lock = threading.RLock()
        self._guard = Guard(self.safety)
        self._drive = Drive(self._bus, self._configuration, self._guard, self._lock)
        self._access = threading.Lock()  # held while connecting or relaxing
        self._thread: threading.Thread | None = None
        self._attempt: ConnectionAttempt | None = None
        self._stop = threading.Event()
        self._torque_owed = False  # torque may be on since an earlier connection

    def connect(self) -> None:
        """Connect and follow commands from the present position; leave the safe state.

        Checks the model, writes the limits into the servo, and only then switches the
        torque on, with the present position as the goal.

        Raises
        ------
        FingerError
            When the port is missing or busy, or the servo does not respond, is another
            model, or reports an alert. If it was connected before, it keeps switching
            the torque off until :meth:`relax`.
        """
        with self._access:
            attempt = ConnectionAttempt()
            relax_at_exit(self)
            try:
                self._begin(attempt)
                attempt.done.wait()
            except BaseException:  # such as Ctrl-C: the thread relaxes and ends
                self._stop.set()
                raise
            if attempt.error is not None:
                raise attempt.error

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one sent, NaN if none is."""
        with self._lock:
            return self._configuration.sent(
                self._guard.command(time.monotonic(), flexion)
            )

    def state(self) -> FingerState:
        """Return the latest known state."""
        with self._lock:
            known, guard = self._drive.known, self._guard
            alert = guard.reason or self._drive.alert
            return replace(
                known,
                age=time.monotonic() - known.time,
                mode=guard.mode,
                sent=self._configuration.sent(guard.goal),
                stalled=guard.stalled,
                alert="; ".join(filter(None, (alert, self._drive.unconfirmed))),
            )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay in it until connected again."""
        with self._lock:
            self._guard.fail(reason)

    def relax(self) -> None:
        """Switch the torque off, read back that it is off, and close the port.

        The finger's own thread does so, whatever interrupts this call. Repeated, it
        tries again what was not confirmed.

        Raises
        ------
        FingerError
            When the servo does not confirm that its torque is off; the port is closed
            even then.
        """
        self._stop.set()
        with self._access:
            self._stop.set()
            alive = self._thread is not None and self._thread.is_alive()
            if self._thread is not None:
                self._thread.join()
                self._thread = None
            if self._torque_owed and not alive:  # what its thread tried has failed
                self._close()
            owed = self._torque_owed
        if owed:
            watchdog = "bus_watchdog" in self._model
            raise not_relaxed(
                self,
                f"{self._bus.port}: servo {self._bus.id} did not confirm that its "
                "torque is off, cut its power"
                + (" (its own watchdog stops it)." if watchdog else "."),
            )

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        """Relax; a failure is added as a note to an exception already raised."""
        relax_after(self.relax, exception[1])

    def _begin(self, attempt: ConnectionAttempt) -> None:
        """Hand an attempt to connect to the thread that owns the bus."""
        thread = self._thread
        if thread is not None and self._stop.is_set():  # an interrupted relaxing
            thread.join()
            thread = None
        self._stop.clear()
        self._attempt = attempt
        if thread is None or not thread.is_alive():
            self._thread = threading.Thread(
                target=self._run, daemon=True, name=f"finger on {self._bus.port}"
            )
            self._thread.start()

    def _run(self) -> None:
        """Own the bus from connecting until the torque is off, whatever happens."""
        try:
            self._serve()
        except BaseException:
            # On a shared port the other servo's packets keep this one's watchdog quiet.
            self._close()
            raise

    def _serve(self) -> None:
        due = time.monotonic()
        while not self._stop.is_set():
            attempt, self._attempt = self._attempt, None
            if ending_requested():
                with self._lock:
                    self._guard.relax()
            if attempt is not None and not self._open(attempt):
                break
            try:
                self._drive.cycle()
            except Exception as error:  # whatever it is, the safe state needs this
                self.make_safe(f"communication with the servo failed with {error!r}")
            due = max(due + self._period, time.monotonic())
            self._stop.wait(max(due - time.monotonic(), 0.0))
        else:
            self._close()
        if (late := self._attempt) is not None:  # it was to relax before it connected
            late.error = FingerError(f"{self._bus.port}: connecting was aborted.")
            late.done.set()

    def _open(self, attempt: ConnectionAttempt) -> bool:
        """Connect, on the thread; return whether the bus is still needed."""
        connected_before = self._torque_owed
        with self._lock:
            self._guard.relax()
        self._bus.close()
        try:
            self._bus.open()
            self._bus.tries = _TRIES  # nothing is time-critical yet
            self._bus.check()  # another servo stays untouched
            self._torque_owed = True
            self._drive.set_up()
            if self._stop.is_set() or ending_requested():
                raise FingerError(f"{self._bus.port}: connecting was aborted.")
            self._drive.arm()
        except BaseException as error:  # the caller's
            with self._lock:
                self._guard.relax()
            attempt.error = error
        finally:
            self._bus.tries = 1
        needed = connected_before or attempt.error is None
        if not needed:
            self._close()
        attempt.done.set()
        return needed

    def _close(self) -> None:
        """Switch torque off, where it was ever on, and close the port."""
        if self._torque_owed:
            self._torque_owed = not self._drive.release(_RELAX_TIMEOUT)
        self._bus.close()
        if not self._torque_owed:
            forget(self)
