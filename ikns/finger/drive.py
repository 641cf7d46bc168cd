"""What is said to a servo, and in which order, so that it never moves unasked."""

from __future__ import annotations

import contextlib
import math
import threading
import time

from ikns.finger.bus import Bus, NoAnswer, Refused, Unplugged
from ikns.finger.configuration import ANSWER_ALL, ServoConfiguration
from ikns.finger.errors import FingerError
from ikns.finger.guard import Guard
from ikns.finger.state import FingerState

__all__ = ["Drive"]

_WATCHDOG_UNIT = 0.02
#: Seconds between looks at whether torque is still on, and between tries to reopen.
_LOOK, _REOPEN = 0.1, 0.2
_BEGINNINGS = {
    2: ("moving", "realtime_tick", "goal_position", "profile_velocity"),
    1: ("present_position", "goal_pwm", "profile_velocity", "goal_position"),
}


class Drive:
    """Carries out what a guard decides.

    Parameters
    ----------
    bus : Bus
        Used by one thread at a time.
    configuration : ServoConfiguration
    guard : Guard
    lock : lock
        Held while guard or results are touched, never while the bus is in use.

    Attributes
    ----------
    known : FingerState
        The last that was measured.
    alert : str
        Complaint while no reason of the guard says more.
    """

    def __init__(
        self,
        bus: Bus,
        configuration: ServoConfiguration,
        guard: Guard,
        lock: threading.RLock,
    ) -> None:
        self._bus, self._configuration, self._guard, self._lock = (
            bus,
            configuration,
            guard,
            lock,
        )
        self.known = FingerState()
        self.alert = ""
        self._torque = False  # as far as is known
        self._told: int | None = None
        self._beginning = 0
        self._answered = self._looked = self._tried = -math.inf

    def set_up(self) -> None:
        """Write limits, with torque off; permanent memory only where it differs."""
        bus, model = self._bus, self._bus.model
        configuration = self._configuration
        with contextlib.suppress(NoAnswer):  # it may be set up to say nothing
            if bus.read("status_return_level") != ANSWER_ALL:
                bus.write("status_return_level", ANSWER_ALL)
        if complaint := bus.alerts():
            raise FingerError(
                f"{bus.port}: servo {bus.id} reports {complaint}; let it rest and "
                "switch its power off and on."
            )
        self._no_torque()
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
        """Switch torque on with the present position as the goal."""
        bus = self._bus
        values = self._measure()
        with self._lock:
            self._guard.start(time.monotonic(), values.flexion)
            self.alert = ""
        self._switch_on()
        bus.read("torque_enable")

    def cycle(self) -> None:
        """Say and ask once; whatever goes wrong becomes the guard's decision."""
        now = time.monotonic()
        with self._lock:
            self._guard.tick(now)
            torque, goal = self._guard.torque, self._guard.goal
        try:
            self._write_goal(torque, goal)
            self._read_state()
        except Unplugged as error:
            self._fail(str(error))
            self._reopen()
        except NoAnswer:
            if time.monotonic() - self._answered > self._guard.safety.silence_timeout:
                silent = self._guard.safety.silence_timeout
                self._fail(f"no answer from the servo for {silent:g} s")
        except FingerError as error:
            self._fail(str(error))

    def let_go(self, timeout: float) -> bool:
        """Switch torque off; return whether the servo confirmed it in time."""
        with self._lock:
            self._guard.relax()
        give_up = time.monotonic() + timeout
        while True:
            try:
                self._switch_off()
            except Unplugged:
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
                self._switch_off()
            return
        if not self._torque:  # it has been away, or has stopped by itself
            values = self._measure()
            with self._lock:
                self._guard.hold_at(time.monotonic(), values.flexion)
            self._switch_on()
            return
        ticks = self._configuration.ticks(goal)
        if ticks != self._told:
            self._tell(ticks)

    def _tell(self, ticks: int) -> None:
        try:
            self._bus.write("goal_position", ticks)
        except Refused:
            if not self._watchdog_tripped():
                raise
            self._torque = False  # it stands still; taken up again from there
            self._fail(
                f"the servo heard nothing for {self._configuration.watchdog:g} s"
            )
            return
        self._told = ticks

    def _watchdog_tripped(self) -> bool:
        return (
            "bus_watchdog" in self._bus.model and self._bus.read("bus_watchdog") == -1
        )

    def _switch_on(self) -> None:
        """Never with an old goal, and never before the watchdog's error is cleared."""
        bus = self._bus
        with self._lock:
            goal = self._guard.goal
        if math.isnan(goal):
            return
        watchdog = "bus_watchdog" in bus.model
        self._switch_off()
        for name, value in self._configuration.ram_registers(bus.model).items():
            bus.write(name, value)
        # A goal alone switches an AX-12 on, so it comes last but for torque itself.
        self._torque = True
        self._told = self._configuration.ticks(goal)
        bus.write("goal_position", self._told)
        bus.write("torque_enable", 1)
        if watchdog:
            steps = math.ceil(self._configuration.watchdog / _WATCHDOG_UNIT)
            bus.write("bus_watchdog", steps)

    def _switch_off(self) -> None:
        """Torque off, read back; a servo that starts again has no watchdog error."""
        bus = self._bus
        self._no_torque()
        self._torque, self._told = False, None
        if "bus_watchdog" in bus.model:
            bus.write("bus_watchdog", 0)

    def _no_torque(self) -> None:
        """Switch torque off and read that it is off.

        Answers carry no number, so a late one may be taken for the next. The LED is
        read as well only to make this answer as long as no other while it runs.
        """
        bus = self._bus
        bus.write("torque_enable", 0)
        if bus.read_many("torque_enable", "led")["torque_enable"]:
            raise FingerError(f"{bus.port}: servo {bus.id} does not let go of torque.")

    def _read_state(self) -> None:
        values = self._measure()
        now = time.monotonic()
        with self._lock:
            self._guard.measured(now, values.flexion)
        if self._bus.alert:
            complaint = self._bus.alerts() or "a hardware alert"
            with self._lock:
                self.alert = complaint
                self._guard.fail(f"the servo reports {complaint}", limp=True)
        if self._torque and now - self._looked > _LOOK:
            self._looked = now
            # An AX-12 that starts again takes up torque with the next goal, but has
            # forgotten how fast it may go.
            name = "profile_velocity"
            speed = self._configuration.ram_registers(self._bus.model)[name]
            if not self._bus.read("torque_enable") or self._bus.read(name) != speed:
                with self._lock:
                    self._guard.fail("the servo has lost its torque", limp=True)
            elif self._watchdog_tripped():
                self._torque = False
                self._fail(
                    f"the servo heard nothing for {self._configuration.watchdog:g} s"
                )

    def _measure(self) -> FingerState:
        """Read everything that the servo measures, at once.

        Where to begin changes after every failure, and with it the answer's length, so
        that an answer to an earlier question is not taken for news.
        """
        bus, model = self._bus, self._bus.model
        last = "present_temperature" if model.protocol == 2 else "moving"
        try:
            values = bus.read_many(_BEGINNINGS[model.protocol][self._beginning], last)
        except NoAnswer:
            self._beginning = (self._beginning + 1) % len(_BEGINNINGS[model.protocol])
            raise
        now = self._answered = time.monotonic()
        towards = math.copysign(1.0, self._configuration.span)
        current = values.get("present_current", math.nan) * model.current_unit
        load = values.get("present_load", math.nan) / 1000
        if not math.isnan(current):
            load = current / (model["current_limit"].upper * model.current_unit)
        known = FingerState(
            time=now,
            flexion=self._configuration.flexion(values["present_position"]),
            current=towards * current,
            load=towards * load,
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
        """Take the port up again when it is back; torque then starts from anew."""
        now = time.monotonic()
        if now - self._tried < _REOPEN:
            return
        self._tried = now
        self._bus.close()
        try:
            self._bus.open()
            self._bus.check(diagnose=False)
        except NoAnswer:
            pass  # it may hear all the same, so it must be told to let go
        except FingerError:
            self._bus.close()
