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

__all__ = ["Drive"]

#: Unit of the bus watchdog's register, s.
_WATCHDOG_UNIT = 0.02
#: Seconds between checks that torque is still on, and between attempts to reopen the
#: port.
_CHECK_INTERVAL, _REOPEN_INTERVAL = 0.1, 0.2
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
        self.known = FingerState()
        self.alert = ""
        self._torque = False  # as far as known
        self._sent: int | None = None
        self._first_register = 0
        self._responded = self._checked = self._reopened = -math.inf

    def set_up(self) -> None:
        """Write the limits, with torque off, and only where they differ."""
        bus, model = self._bus, self._bus.model
        configuration = self._configuration
        with contextlib.suppress(NoResponse):  # it may be configured not to respond
            if bus.read("status_return_level") != RESPOND_TO_ALL:
                bus.write("status_return_level", RESPOND_TO_ALL)
        if alert := bus.alerts():
            raise FingerError(
                f"{bus.port}: servo {bus.id} reports {alert}; let it rest and "
                "switch its power off and on."
            )
        self._write_torque_off()
        if "bus_watchdog" in model:
            bus.write("bus_watchdog", 0)
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
        bus = self._bus
        values = self._measure()
        with self._lock:
            self._guard.start(time.monotonic(), values.flexion)
            self.alert = ""
        self._torque_on()
        bus.read("torque_enable")

    def cycle(self) -> None:
        """Write the goal and read the state once; the guard handles any failure."""
        now = time.monotonic()
        with self._lock:
            self._guard.tick(now)
            torque, goal = self._guard.torque, self._guard.goal
        try:
            self._write_goal(torque, goal)
            self._read_state()
        except PortLost as error:
            self._fail(str(error))
            self._reopen()
        except NoResponse:
            if time.monotonic() - self._responded > self._guard.safety.silence_timeout:
                timeout = self._guard.safety.silence_timeout
                self._fail(f"no answer from the servo for {timeout:g} s")
        except FingerError as error:
            self._fail(str(error))

    def release(self, timeout: float) -> bool:
        """Switch torque off; return whether the servo confirmed it within `timeout`."""
        with self._lock:
            self._guard.relax()
        give_up = time.monotonic() + timeout
        while True:
            try:
                self._torque_off()
            except PortLost:
                self._reopen()
                time.sleep(0.01)
            except FingerError:
                pass
            else:
                return True
            if time.monotonic() > give_up:
                return False

    def _write_goal(self, torque: bool, goal: float) -> None:
        if not torque:
            if self._torque:
                self._torque_off()
            return
        if not self._torque:  # it was unreachable, or its watchdog stopped it
            values = self._measure()
            with self._lock:
                self._guard.hold_at(time.monotonic(), values.flexion)
            self._torque_on()
            return
        ticks = self._configuration.ticks(goal)
        if ticks != self._sent:
            self._send_goal(ticks)

    def _send_goal(self, ticks: int) -> None:
        try:
            self._bus.write("goal_position", ticks)
        except Rejected:
            if not self._watchdog_tripped():
                raise
            self._torque = False  # it stands still; the next cycle restarts it there
            self._fail(
                f"the servo received nothing for {self._configuration.watchdog:g} s"
            )
            return
        self._sent = ticks

    def _watchdog_tripped(self) -> bool:
        return (
            "bus_watchdog" in self._bus.model and self._bus.read("bus_watchdog") == -1
        )

    def _torque_on(self) -> None:
        """Switch torque on, only with a fresh goal and the watchdog's error cleared."""
        bus = self._bus
        with self._lock:
            goal = self._guard.goal
        if math.isnan(goal):
            return
        watchdog = "bus_watchdog" in bus.model
        self._torque_off()
        for name, value in self._configuration.ram_registers(bus.model).items():
            bus.write(name, value)
        # A goal alone switches the torque of an AX-12 on, so it comes last but one.
        self._torque = True
        self._sent = self._configuration.ticks(goal)
        bus.write("goal_position", self._sent)
        bus.write("torque_enable", 1)
        if watchdog:
            steps = math.ceil(self._configuration.watchdog / _WATCHDOG_UNIT)
            bus.write("bus_watchdog", steps)

    def _torque_off(self) -> None:
        """Switch torque off and clear the watchdog's error."""
        bus = self._bus
        self._write_torque_off()
        self._torque, self._sent = False, None
        if "bus_watchdog" in bus.model:
            bus.write("bus_watchdog", 0)

    def _write_torque_off(self) -> None:
        """Switch torque off and read back that it is off.

        Responses carry no number, so a late one may be taken for the next. The LED is
        read too only to give this response a length that no other response has.
        """
        bus = self._bus
        bus.write("torque_enable", 0)
        if bus.read_many("torque_enable", "led")["torque_enable"]:
            raise FingerError(
                f"{bus.port}: servo {bus.id} does not switch its torque off."
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
        if self._torque and now - self._checked > _CHECK_INTERVAL:
            self._checked = now
            # An AX-12 that rebooted switches torque on with the next goal, but has lost
            # its speed limit.
            name = "profile_velocity"
            speed = self._configuration.ram_registers(self._bus.model)[name]
            if not self._bus.read("torque_enable") or self._bus.read(name) != speed:
                with self._lock:
                    self._guard.fail("the servo has lost its torque", limp=True)
            elif self._watchdog_tripped():
                self._torque = False
                self._fail(
                    f"the servo received nothing for {self._configuration.watchdog:g} s"
                )

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
        """Reopen the port once it is back; torque is then switched on again."""
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
