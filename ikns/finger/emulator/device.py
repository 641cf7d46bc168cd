"""A simulated Dynamixel servo: instruction bytes in, status bytes out, no port."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from ikns.errors import InvalidInput
from ikns.finger.control_table import Register
from ikns.finger.emulator.baud import baud_code, baud_rate
from ikns.finger.emulator.instructions import (
    ReadRequest,
    bulk_read,
    bulk_writes,
    sync_read,
    sync_writes,
)
from ikns.finger.emulator.memory import Memory, StatusError
from ikns.finger.emulator.motor import Motor
from ikns.finger.emulator.packet import BROADCAST, Packet, Parser
from ikns.finger.emulator.reply import Reply, expects_reply, make_reply
from ikns.finger.models import alert_text, model_named

_WATCHDOG_UNIT = 0.02
_BOOT = 0.2
_GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
_OVERHEATING, _SHOCK, _OVERLOAD = 2, 4, 5


class Servo:
    """A simulated servo.

    Parameters
    ----------
    model : str
        One of :data:`ikns.finger.models.MODELS`.
    id : int
    baud : int
        Bits per second; determines how long responses take on the wire.
    position : float, optional
        Position of the horn, ticks; the center by default.
    clock : callable
        Seconds, monotonic.

    Attributes
    ----------
    motor : Motor
    memory : Memory
        Control table.
    events : deque of (float, str)
        Events with their times, latest last.
    goals : deque of (float, int)
        Goal positions that it accepted, with their times, latest last.

    Examples
    --------
    >>> servo = Servo("xl430", clock=lambda: 0.0)
    >>> [reply] = servo.receive(bytes.fromhex("ff ff fd 00 01 03 00 01 19 4e"))
    >>> reply.data.hex(" ")
    'ff ff fd 00 01 07 00 55 00 24 04 2e fe df'
    """

    def __init__(
        self,
        model: str = "xl430",
        *,
        id: int = 1,
        baud: int = 57600,
        position: float | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.model = model_named(model)
        self.memory = Memory(self.model)
        number = self.model["id"]
        if not number.lower <= id <= number.upper:
            raise InvalidInput(
                f"a servo's id must be {number.lower} to {number.upper}, not {id}."
            )
        self.memory["id"] = id
        self.memory["baud_rate"] = baud_code(self.model, baud)
        middle = (self.model.highest + 1) / 2
        self.motor = Motor(self.model, middle if position is None else float(position))
        self.events: deque[tuple[float, str]] = deque(maxlen=10_000)
        self.goals: deque[tuple[float, int]] = deque(maxlen=1_000_000)
        self._clock = clock
        self._parser = Parser(self.model.protocol)
        self._now = self._received = clock()
        self._silent_until = -math.inf
        self._registered: bytes | None = None
        self.memory["goal_position"] = round(self.motor.position)
        self._update_registers()

    @property
    def id(self) -> int:
        """Its number on the bus."""
        return self.memory["id"]

    @property
    def baud(self) -> float:
        """Its bit rate, bits per second."""
        return baud_rate(self.model, self.memory["baud_rate"])

    @property
    def torque(self) -> bool:
        """Whether the motor is on."""
        return bool(self.memory["torque_enable"])

    @property
    def watchdog_error(self) -> bool:
        """Whether the bus watchdog has stopped it."""
        return "bus_watchdog" in self.model and self.memory["bus_watchdog"] == -1

    def receive(self, data: bytes) -> list[Reply]:
        """Receive bytes from the wire; return the responses."""
        self.advance()
        if self._now < self._silent_until:
            return []
        replies = []
        for packet in self._parser.feed(data):
            self._received = self._now
            statuses = self._execute(packet)
            if expects_reply(packet, self.memory["status_return_level"]):
                replies += [
                    make_reply(
                        self.model,
                        self.memory,
                        packet,
                        turn=turn,
                        error=error,
                        content=content,
                        now=self._now,
                    )
                    for turn, error, content in statuses
                ]
        self._update_registers()
        return replies

    def advance(self) -> None:
        """Advance to the clock's time."""
        now = self._clock()
        duration, self._now = now - self._now, now
        if duration <= 0:
            return
        self._check_watchdog()
        memory = self.memory
        rate, acceleration, max_effort = memory.motion_limits()
        goal = self.motor.profile if self.watchdog_error else memory["goal_position"]
        self.motor.move(
            duration,
            goal,
            torque=self.torque,
            rate=rate,
            acceleration=acceleration,
            max_effort=max_effort,
        )
        if self.motor.overloaded:
            self.raise_alert(_OVERLOAD)
        if self.motor.temperature > memory["temperature_limit"]:
            self.raise_alert(_OVERHEATING)
        self._update_registers()

    def raise_alert(self, bit: int) -> None:
        """Raise a hardware alert; depending on ``shutdown`` it switches torque off."""
        if self.memory.alert >> bit & 1:
            return
        self.memory.alert |= 1 << bit
        self._note(f"alert: {alert_text(1 << bit, self.model.protocol) or 'shock'}")
        if self.memory["shutdown"] >> bit & 1 or self.model.protocol == 1:
            self._torque_off()

    def shock(self) -> None:
        """Raise an electrical shock alert, or an overload alert if there is none."""
        self.raise_alert(_SHOCK if self.model.protocol == 2 else _OVERLOAD)

    def overheat(self) -> None:
        """Exceed the temperature limit."""
        self.motor.temperature = self.memory["temperature_limit"] + 5.0
        self.raise_alert(_OVERHEATING)

    def restart(self) -> None:
        """Restart as after a loss of power: RAM reset, torque off, no alert."""
        self.memory.reset_ram()
        self.memory["goal_position"] = round(self.motor.position)
        self.motor.stop()
        self._registered = None
        self._parser.reset()
        self._silent_until = self._now + _BOOT
        self._note("started again")
        self._update_registers()

    def _check_watchdog(self) -> None:
        """Stop when nothing was received for too long."""
        if "bus_watchdog" not in self.model or not self.torque:
            self._received = self._now
            return
        limit = self.memory["bus_watchdog"] * _WATCHDOG_UNIT
        if limit > 0 and self._now - self._received > limit:
            self.memory["bus_watchdog"] = -1
            self.motor.stop()
            self._note(f"bus watchdog: no data for {limit:g} s, stopped")

    def _torque_off(self) -> None:
        if self.torque:
            self.memory["torque_enable"] = 0
            self.motor.stop()
            self._note("torque off")

    def _update_registers(self) -> None:
        """Write the measurements into the control table."""
        values = self.motor.measurements() | {
            "realtime_tick": 1000 * self._now % 32768,
            "hardware_error_status": self.memory.alert,
            "registered_instruction": self._registered is not None,
        }
        # A goal that is not reached counts as motion from the first moment on.
        left = self.memory["goal_position"] - self.motor.profile
        watched = self.memory["bus_watchdog"] if "bus_watchdog" in self.model else 0
        if self.torque and watched >= 0 and abs(left) >= 1:
            values["moving"] = 1
        for name, value in values.items():
            if name in self.model:
                self.memory[name] = int(value)

    def _note(self, text: str) -> None:
        self.events.append((self._now, text))

    def _execute(self, packet: Packet) -> list[tuple[int, int, bytes]]:
        """Execute a packet; return (turn, error, content) of each response."""
        if packet.id not in (self.id, BROADCAST):
            return []
        if not packet.intact:
            return [(0, StatusError.CRC, b"")]
        try:
            return self._instruction(packet)
        except StatusError as error:
            return [(0, error.number, b"")]

    def _instruction(self, packet: Packet) -> list[tuple[int, int, bytes]]:
        data, protocol = packet.data, self.model.protocol
        wide = protocol == 2
        size = protocol  # bytes of an address or a length

        def number(at: int) -> int:
            return int.from_bytes(data[at : at + size], "little")

        def read(request: ReadRequest | None) -> list[tuple[int, int, bytes]]:
            if request is None:
                return []
            turn, address, count = request
            return [(turn, 0, self.memory.read(address, count))]

        match packet.instruction:
            case 0x01:  # ping
                about = self.memory.read(0, 2) + self.memory.read(6, 1) if wide else b""
                return [(0 if packet.id == self.id else self.id, 0, about)]
            case 0x02 if len(data) == 2 * size:  # read
                return [(0, 0, self.memory.read(number(0), number(size)))]
            case 0x03 if len(data) > size:  # write
                self._write(number(0), data[size:])
                return [(0, 0, b"")]
            case 0x04 if len(data) > size:  # reg write
                self.memory.check(number(0), data[size:])
                self._registered = data
                return [(0, 0, b"")]
            case 0x05 if self._registered is not None:  # action
                registered, self._registered = self._registered, None
                self._write(
                    int.from_bytes(registered[:size], "little"), registered[size:]
                )
                return [(0, 0, b"")]
            case 0x08 if wide:  # reboot
                self.restart()
                return [(0, 0, b"")]
            case 0x10 if wide and data == b"\x01DXL\x22":  # clear multi-turn position
                if self.motor.velocity:
                    raise StatusError(StatusError.FAILED)
                self.motor.position %= self.model.ticks_per_turn
                self.motor.stop()
                return [(0, 0, b"")]
            case 0x83:  # sync write
                for address, content in sync_writes(data, protocol, self.id):
                    self._write(address, content)
                return []
            case 0x93 if wide:  # bulk write
                for address, content in bulk_writes(data, self.id):
                    self._write(address, content)
                return []
            case 0x82 if wide:  # sync read
                return read(sync_read(data, self.id))
            case 0x92:  # bulk read
                return read(bulk_read(data, protocol, self.id))
        # A factory reset among others: an emulator has no factory settings.
        raise StatusError(StatusError.INSTRUCTION)

    def _write(self, address: int, data: bytes) -> None:
        written = self.memory.check(address, data)
        if self.watchdog_error and any(r.name in _GOALS for r, _ in written):
            raise StatusError(StatusError.RANGE)
        for register, value in written:
            self._set(register, value)

    def _set(self, register: Register, value: int) -> None:
        if register.name == "torque_enable":
            if value and not self.torque:
                if self.memory.alert:
                    return  # stays off until a restart
                self.motor.stop()
                self._note("torque on")
            elif not value:
                self._torque_off()
        self.memory[register.name] = value
        if register.name == "goal_position":
            self.goals.append((self._now, value))
            # An AX-12 switches torque on when it gets a goal.
            if self.model.protocol == 1 and not self.torque and not self.memory.alert:
                self.memory["torque_enable"] = 1
                self._note("torque on")
