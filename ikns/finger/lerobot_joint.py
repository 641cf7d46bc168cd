"""One joint of a robot of lerobot: its position as flexion, and its torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Protocol

from ikns.errors import InvalidInput
from ikns.finger.errors import FingerError


class RobotDevice(Protocol):
    """What is used of ``lerobot.robots.Robot``."""

    action_features: Mapping[str, Any]
    is_connected: bool
    is_calibrated: bool

    def connect(self, calibrate: bool = True) -> None:
        """Open the port and switch torque on."""

    def get_observation(self) -> Mapping[str, Any]:
        """Return positions by name."""

    def send_action(self, action: dict[str, Any]) -> Mapping[str, Any]:
        """Take goals by name; return those that were sent."""

    def disconnect(self) -> None:
        """Switch torque off, by convention, and close the port."""


class RobotJoint:
    """A joint whose robot is used by one thread at a time.

    lerobot has no call for torque. The joint's motor is switched off, and read back,
    where the robot has a motor bus of lerobot (``robot.bus``); otherwise the robot is
    disconnected, which by lerobot's convention switches it off, unconfirmed.

    Parameters
    ----------
    robot : RobotDevice
    name : str
        One of the robot's action features.
    open, closed : float
        Its values at flexion 0 and 1.

    Attributes
    ----------
    port : str
        Of the robot; empty where its configuration has none.
    off : bool
        Whether torque is off, as far as the robot lets one know.
    """

    def __init__(
        self, robot: RobotDevice, name: str, *, open: float, closed: float
    ) -> None:
        if name not in robot.action_features:
            raise InvalidInput(
                f"expected a joint of the robot, one of "
                f"{', '.join(robot.action_features)}, found '{name}'."
            )
        if not (math.isfinite(open) and math.isfinite(closed) and open != closed):
            raise InvalidInput(
                "open and closed must be two finite values of the joint, "
                f"not {open:g} and {closed:g}."
            )
        configuration = getattr(robot, "config", None)
        if (
            getattr(configuration, "disable_torque_on_disconnect", True) is False
            and getattr(robot, "bus", None) is None
        ):
            raise InvalidInput(
                "expected a robot that switches its torque off when disconnected, "
                "found disable_torque_on_disconnect=false and no motor bus."
            )
        self._robot, self.name = robot, name
        self.port = str(getattr(configuration, "port", ""))
        self._open, self._span = open, closed - open
        self._others: dict[str, Any] = {}
        self.off = True
        self._unconfirmed = False  # disconnected, and torque was not known to be off

    def connect(self) -> float:
        """Connect, or connect again; return the flexion measured.

        Raises
        ------
        FingerError
            When the robot was never calibrated.
        Exception
            Whatever the robot raises.
        """
        robot = self._robot
        self.disconnect()
        self.off = False
        robot.connect(calibrate=False)  # calibrating would ask at a terminal
        if not robot.is_calibrated:
            raise FingerError(
                f"the robot with {self.name} is not calibrated: run lerobot-calibrate "
                "with its type, port and id first."
            )
        seen = robot.get_observation()
        # An action names every joint; those that are not ours stay where they are.
        self._others = {n: float(seen[n]) for n in robot.action_features if n in seen}
        return self.flexion(seen)

    def send(self, flexion: float) -> float:
        """Send a goal; return what the robot made of it, for it may have limits too."""
        self.off = False
        value = self._open + flexion * self._span
        return self.flexion(self._robot.send_action(self._others | {self.name: value}))

    def observe(self) -> float:
        """Return the flexion measured; NaN while the robot is disconnected."""
        if not self._robot.is_connected:
            return math.nan
        return self.flexion(self._robot.get_observation())

    def switch_off(self) -> None:
        """Switch torque off, and read it back where that is possible.

        Where disconnecting did not confirm it, only the motor bus is opened again: the
        robot would switch its torque on.
        """
        bus: Any = getattr(self._robot, "bus", None)
        motor = self.name.partition(".")[0]
        if not (self._robot.is_connected or self._unconfirmed):
            self.off = True
        elif motor in getattr(bus, "motors", ()):
            if not (self._robot.is_connected or bus.is_connected):
                bus.connect()
            bus.disable_torque(motor)
            self.off = bus.read("Torque_Enable", motor, normalize=False) == 0
        elif self._robot.is_connected:
            self.disconnect()
            self.off = True

    def disconnect(self) -> None:
        """Disconnect the robot, if it is connected, and its motor bus."""
        if self._robot.is_connected:
            self._unconfirmed = not self.off
            self._robot.disconnect()
            # Without a bus, having disconnected is all the confirmation there is.
            if getattr(self._robot, "bus", None) is None:
                self._unconfirmed = False
        elif self._unconfirmed:
            bus: Any = getattr(self._robot, "bus", None)
            self._unconfirmed = not self.off
            if getattr(bus, "is_connected", False):
                bus.disconnect()

    def flexion(self, values: Mapping[str, Any]) -> float:
        """Return the flexion of a position among others, not clipped."""
        return (float(values[self.name]) - self._open) / self._span
