"""The torque of a servo: what is believed of it was read from its registers.

A write, a tripped watchdog or a servo that answers late says nothing about the torque.
"""

from __future__ import annotations

import math
import time

from ikns.finger.bus import Bus
from ikns.finger.configuration import ServoConfiguration
from ikns.finger.errors import FingerError

#: Unit of the bus watchdog's register, s.
_WATCHDOG_UNIT = 0.02
#: What `Torque.check` says of a servo without torque, or with other settings.
LOST = "the servo has lost its torque"


class Torque:
    """Switches the torque of a servo.

    Parameters
    ----------
    bus : Bus
    configuration : ServoConfiguration

    Attributes
    ----------
    on : bool or None
        As last read; None if it may have changed since, or the read failed.
    ready : bool
        Whether torque, watchdog and speed limit were last read to be as set.
    checked : float
        When torque was last read, s.
    """

    def __init__(self, bus: Bus, configuration: ServoConfiguration) -> None:
        self._bus, self._configuration = bus, configuration
        self.on: bool | None = None
        self.ready = False
        self.checked = -math.inf

    @property
    def _has_watchdog(self) -> bool:
        return "bus_watchdog" in self._bus.model

    @property
    def _watchdog_steps(self) -> int:
        return math.ceil(self._configuration.watchdog / _WATCHDOG_UNIT)

    def read(self) -> bool:
        """Read whether torque is on.

        Responses carry no number, so a late one may be taken for the next. The LED is
        read too only to give this response a length that no other response has.
        """
        self.on = None
        values = self._bus.read_many("torque_enable", "led")
        self.on, self.checked = bool(values["torque_enable"]), time.monotonic()
        return self.on

    def switch_off(self) -> None:
        """Switch torque off, read that it is off, and clear the watchdog's error."""
        bus = self._bus
        self.on, self.ready = None, False
        bus.write("torque_enable", 0)
        if self.read():
            raise FingerError(
                f"{bus.port}: servo {bus.id} does not switch its torque off."
            )
        if self._has_watchdog:
            bus.write("bus_watchdog", 0)

    def switch_on(self, ticks: int) -> str:
        """Switch torque on with a fresh goal and the watchdog's error cleared.

        Returns
        -------
        str
            As :meth:`check`.
        """
        bus = self._bus
        self.switch_off()
        for name, value in self._configuration.ram_registers(bus.model).items():
            bus.write(name, value)
        # A goal alone switches the torque of an AX-12 on, so it comes last but one.
        self.on = None
        bus.write("goal_position", ticks)
        bus.write("torque_enable", 1)
        if self._has_watchdog:
            bus.write("bus_watchdog", self._watchdog_steps)
        return self.check()

    def check(self) -> str:
        """Read whether torque, watchdog and speed limit are as they were set.

        Returns
        -------
        str
            What is wrong, :data:`LOST` or that the watchdog has tripped; empty if
            nothing is.
        """
        model = self._bus.model
        self.read()
        # Together they make a response of a length that no other has.
        first, last = ("profile_velocity", "goal_pwm")
        if self._has_watchdog:
            first, last = ("bus_watchdog", "profile_velocity")
        values = self._bus.read_many(first, last)
        watchdog = values.get("bus_watchdog")
        # An AX-12 that rebooted switches torque on with the next goal, but has lost its
        # speed limit.
        speed = self._configuration.ram_registers(model)["profile_velocity"]
        wrong = ""
        if watchdog == -1:  # it may have cleared the speed limit too
            wrong = f"the servo received nothing for {self._configuration.watchdog:g} s"
        elif (
            not self.on
            or values["profile_velocity"] != speed
            or watchdog not in (None, self._watchdog_steps)
        ):
            wrong = LOST
        self.ready = not wrong
        return wrong
