"""Communication with a servo, in an order in which it never moves unexpectedly."""

from __future__ import annotations

import contextlib
import math
import threading
import time

from ikns.finger.bus import Bus
from ikns.finger.configuration import RESPOND_TO_ALL, ServoConfiguration
from ikns.finger.errors import FingerError, NoResponse, PortLost, Rejected
from ikns.finger.guard import Guard
from ikns.finger.state import FingerState
from ikns.finger.torque import LOST, Torque

#: Seconds between readings of torque and settings, and between attempts to reopen the
#: port.
_CHECK_INTERVAL, _REOPEN_INTERVAL = 0.1, 0.2
#: Torque that should be off and was not read to be off for so long is reported, s.
_CONFIRM_TIMEOUT = 1.0
#: Where a read of the state starts, by protocol; see `Drive._measure`.
_FIRST_REGISTERS = {
    2: ("moving", "realtime_tick", "goal_position", "profile_velocity"),
    1: ("present_position", "goal_pwm", "profile_velocity", "goal_position"),
}


class Drive:
    """Sends the guard's goals to a servo and its measurements to the guard.

    Parameters
    ----------
    bus : Bus
        Used by one thread at a time.
    configuration : ServoConfiguration
    guard : Guard
    lock : lock
        Held while guard or results are accessed, never while the bus is in use.

    Attributes
    ----------
    known : FingerState
        Latest measurement.
    alert : str
        Hardware alert of the servo; the guard's reason takes precedence.
    unconfirmed : str
        What to do about torque that should be off and was not read to be off in time;
        empty otherwise.
    """

    def __init__(
        self,
        bus: Bus,
        configuration: ServoConfiguration,
        guard: Guard,
        lock: threading.RLock,
    ) -> None:
        self._bus, self._configuration = bus, configuration
        self._guard, self._lock = guard, lock
        self._torque = Torque(bus, configuration)
        self.known = FingerState()
        self.alert = self.unconfirmed = ""
        self._sent: int | None = None
        self._first_register = 0
        self._responded = self._reopened = -math.inf
        self._unwanted_since = math.inf

    def set_up(self) -> None:
        """Write the limits, with torque off, and only where they differ."""
        bus, model = self._bus, self._bus.model
        configuration = self._configuration
        with contextlib.suppress(NoResponse):  # it may be configured not to respond
            if bus.read("status_return_level") != RESPOND_TO_ALL:
                bus.write("status_return_level", RESPOND_TO_ALL)
        if alert := bus.alerts():
            raise FingerError(
                f"{bus.port}: servo {bus.id} reports {alert}; let it rest, "
                "then power-cycle it."
            )
        self._torque.switch_off()
        for values in (
            configuration.eeprom_registers(model),
            configuration.ram_registers(model),
        ):
            for name, value in values.items():
                if bus.read(name) != value:
                    bus.write(name, value)
                    if bus.read(name) != value:
                        raise FingerError(
                            f"{bus.port}: servo {bus.id} does not keep {name} {value}."
                        )

    def arm(self) -> None:
        """Switch torque on, with the present position as the goal."""
        values = self._measure()
        with self._lock:
            self._guard.start(time.monotonic(), values.flexion)
            self.alert = ""
        self._switch_on()
        if not self._torque.ready:
            raise FingerError(
                f"{self._bus.port}: servo {self._bus.id} does not switch its torque on."
            )

    def cycle(self) -> None:
        """Write the goal and read the state once; the guard handles any failure."""
        with self._lock:
            self._guard.tick(time.monotonic())
        try:
            if self._bus.restore_settings():
                self._fail("another program changed the settings of the port")
            with self._lock:
                torque, goal = self._guard.torque, self._guard.goal
            if torque:
                self._follow(goal)
            else:
                self._keep_off()
            self._read_state()
        except PortLost as error:
            self._fail(str(error))
            self._reopen()
        except NoResponse:
            timeout = self._guard.safety.silence_timeout
            if time.monotonic() - self._responded > timeout:
                self._fail(f"no answer from the servo for {timeout:g} s")
        except FingerError as error:
            self._fail(str(error))
        self._report_torque()

    def release(self, timeout: float) -> bool:
        """Switch torque off; return whether the servo confirmed it within `timeout`."""
        with self._lock:
            self._guard.relax()
        give_up = time.monotonic() + timeout
        while True:
            try:
                self._torque.switch_off()
            except PortLost:
                self._reopen()
                time.sleep(0.01)
            except FingerError:
                pass
            else:
                return True
            if time.monotonic() > give_up:
                return self._torque.on is False

    def _follow(self, goal: float) -> None:
        """Send a goal, to a servo that is as it was set."""
        torque = self._torque
        if not torque.ready:  # it was unreachable, or its watchdog stopped it
            values = self._measure()
            with self._lock:
                self._guard.hold_at(time.monotonic(), values.flexion)
            self._switch_on()
            return
        if time.monotonic() - torque.checked > _CHECK_INTERVAL:
            self._check()
        ticks = self._configuration.ticks(goal)
        if not torque.ready or ticks == self._sent:
            return
        try:
            self._bus.write("goal_position", ticks)
        except Rejected:
            self._check()
            if torque.ready:
                raise
        else:
            self._sent = ticks

    def _keep_off(self) -> None:
        """Switch torque off until that is confirmed, and whenever it is on again."""
        torque = self._torque
        if torque.on is False:
            if time.monotonic() - torque.checked <= _CHECK_INTERVAL:
                return
            torque.read()
        if torque.on is not False:
            torque.switch_off()

    def _switch_on(self) -> None:
        with self._lock:
            goal = self._guard.goal
        if math.isnan(goal):
            return
        self._sent = self._configuration.ticks(goal)
        self._fail_check(self._torque.switch_on(self._sent))

    def _check(self) -> None:
        self._fail_check(self._torque.check())

    def _fail_check(self, wrong: str) -> None:
        if wrong:
            with self._lock:
                self._guard.fail(wrong, limp=wrong == LOST)

    def _report_torque(self) -> None:
        """Say so when torque that should be off is not confirmed to be off in time."""
        now = time.monotonic()
        with self._lock:
            if self._guard.torque or self._torque.on is False:
                self._unwanted_since, self.unconfirmed = math.inf, ""
                return
            self._unwanted_since = min(self._unwanted_since, now)
            if now - self._unwanted_since > _CONFIRM_TIMEOUT:
                self.unconfirmed = (
                    f"servo {self._bus.id} has not confirmed that its torque is off, "
                    "cut its power"
                )

    def _read_state(self) -> None:
        values = self._measure()
        now = time.monotonic()
        with self._lock:
            self._guard.measured(now, values.flexion)
        if self._bus.alert:
            alert = self._bus.alerts() or "a hardware alert"
            with self._lock:
                self.alert = alert
                self._guard.fail(f"the servo reports {alert}", limp=True)

    def _measure(self) -> FingerState:
        """Read all measurements in one instruction.

        The first register changes after every failure, and with it the length of the
        response, so that a late response to an earlier read is recognized.
        """
        bus, model = self._bus, self._bus.model
        first_registers = _FIRST_REGISTERS[model.protocol]
        last = "present_temperature" if model.protocol == 2 else "moving"
        try:
            values = bus.read_many(first_registers[self._first_register], last)
        except NoResponse:
            self._first_register = (self._first_register + 1) % len(first_registers)
            raise
        now = self._responded = time.monotonic()
        direction = math.copysign(1.0, self._configuration.span)
        current = values.get("present_current", math.nan) * model.current_unit
        load = values.get("present_load", math.nan) / 1000
        if not math.isnan(current):
            load = current / (model["current_limit"].upper * model.current_unit)
        known = FingerState(
            time=now,
            flexion=self._configuration.flexion(values["present_position"]),
            current=direction * current,
            load=direction * load,
            temperature=float(values["present_temperature"]),
            voltage=values["present_input_voltage"] / 10,
            moving=bool(values["moving"]),
        )
        with self._lock:
            self.known = known
        return known

    def _fail(self, reason: str) -> None:
        with self._lock:
            self._guard.fail(reason.rstrip("."))

    def _reopen(self) -> None:
        """Reopen the port once it is back; the next cycle goes on from there."""
        now = time.monotonic()
        if now - self._reopened < _REOPEN_INTERVAL:
            return
        self._reopened = now
        self._bus.close()
        try:
            self._bus.open()
            self._bus.check(diagnose=False)
        except NoResponse:
            pass  # it may still receive, so it must be told to switch torque off
        except FingerError:
            self._bus.close()
