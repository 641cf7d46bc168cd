"""A simulated Dynamixel servo: instructions in, true bytes out, no port, no thread."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from ikns.errors import InvalidInput
from ikns.finger.emulator.memory import Memory, Trouble
from ikns.finger.emulator.motor import Motor
from ikns.finger.emulator.packet import BROADCAST, STATUS, Packet, Parser, encode
from ikns.finger.models import Register, alert_text, model_named

__all__ = ["Reply", "Servo"]

_BAUD_CODES = (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000)
_WATCHDOG_UNIT = 0.02
_BOOT = 0.2
_GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
_OVERHEATING, _SHOCK, _OVERLOAD = 2, 4, 5
#: Status errors of Protocol 1.0 for the error numbers of Protocol 2.0.
_ERRORS_1 = {1: 64, 2: 64, 3: 16, 4: 8, 5: 8, 6: 2, 7: 8}


@dataclass(frozen=True)
class Reply:
    """Bytes that a servo sends.

    Parameters
    ----------
    due : float
        When they are complete on the wire, seconds of the servo's clock.
    data : bytes
    """

    due: float
    data: bytes


class Servo:
    """A simulated servo.

    Parameters
    ----------
    model : str
        One of :data:`ikns.finger.models.MODELS`.
    id : int
    baud : int
        Bits per second; sets how long answers take on the wire.
    position : float, optional
        Where the horn is, ticks; the middle by default.
    clock : callable
        Seconds, monotonic.

    Attributes
    ----------
    motor : Motor
    memory : Memory
        Control table.
    events : deque of (float, str)
        What happened, latest last.
    goals : deque of (float, int)
        Goal positions that it was told and took, latest last.

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
        self.memory["baud_rate"] = self._baud_code(baud)
        middle = (self.model.highest + 1) / 2
        self.motor = Motor(self.model, middle if position is None else float(position))
        self.events: deque[tuple[float, str]] = deque(maxlen=10_000)
        self.goals: deque[tuple[float, int]] = deque(maxlen=1_000_000)
        self._clock = clock
        self._parser = Parser(self.model.protocol)
        self._now = self._heard = clock()
        self._silent_until = -math.inf
        self._waiting: bytes | None = None
        self.memory["goal_position"] = round(self.motor.position)
        self._show()

    @property
    def id(self) -> int:
        """Its number on the bus."""
        return self.memory["id"]

    @property
    def baud(self) -> float:
        """Bits per second that it listens at."""
        code = self.memory["baud_rate"]
        return _BAUD_CODES[code] if self.model.protocol == 2 else 2_000_000 / (code + 1)

    @property
    def torque(self) -> bool:
        """Whether the motor is on."""
        return bool(self.memory["torque_enable"])

    @property
    def watchdog_error(self) -> bool:
        """Whether it has stopped because nobody spoke to it."""
        return "bus_watchdog" in self.model and self.memory["bus_watchdog"] == -1

    def receive(self, data: bytes) -> list[Reply]:
        """Take in bytes from the wire; return the answers."""
        self.advance()
        if self._now < self._silent_until:
            return []
        replies = []
        for packet in self._parser.feed(data):
            self._heard = self._now
            statuses = self._obey(packet)
            if self._wanted(packet) or packet.instruction in (0x01, 0x82, 0x92):
                for turn, error, content in statuses:
                    replies.append(self._reply(packet, turn, error, content))
        self._show()
        return replies

    def advance(self) -> None:
        """Let the clock's time pass."""
        now = self._clock()
        duration, self._now = now - self._now, now
        if duration <= 0:
            return
        self._watch()
        memory, model = self.memory, self.model
        speed = memory["profile_velocity"] * model.velocity_unit or math.inf
        acceleration = math.inf
        if "profile_acceleration" in model:
            acceleration = memory["profile_acceleration"] or math.inf
            acceleration *= model.acceleration_unit
        goal = self.motor.profile if self.watchdog_error else memory["goal_position"]
        self.motor.move(
            duration,
            goal,
            torque=self.torque,
            rate=speed,
            acceleration=acceleration,
            max_effort=self._max_effort(),
        )
        if self.motor.overloaded:
            self.complain(_OVERLOAD)
        if self.motor.temperature > memory["temperature_limit"]:
            self.complain(_OVERHEATING)
        self._show()

    def complain(self, bit: int) -> None:
        """Raise a hardware alert; one that is set up so switches the motor off."""
        if self.memory.alert >> bit & 1:
            return
        self.memory.alert |= 1 << bit
        self._note(f"alert: {alert_text(1 << bit, self.model.protocol) or 'shock'}")
        if self.memory["shutdown"] >> bit & 1 or self.model.protocol == 1:
            self._torque_off()

    def shock(self) -> None:
        """Raise an electrical shock alert, or an overload where that is unknown."""
        self.complain(_SHOCK if self.model.protocol == 2 else _OVERLOAD)

    def overheat(self) -> None:
        """Get hotter than allowed."""
        self.motor.temperature = self.memory["temperature_limit"] + 5.0
        self.complain(_OVERHEATING)

    def restart(self) -> None:
        """Start again as after a loss of power: RAM forgotten, torque off, no alert."""
        self.memory.forget()
        self.memory["goal_position"] = round(self.motor.position)
        self.motor.stop()
        self._waiting = None
        self._parser.forget()
        self._silent_until = self._now + _BOOT
        self._note("started again")
        self._show()

    def _baud_code(self, baud: int) -> int:
        if self.model.protocol == 1:
            if 7843 <= baud <= 1_000_000:
                return round(2_000_000 / baud) - 1
        elif baud in _BAUD_CODES:
            return _BAUD_CODES.index(baud)
        known = "7843 to 1000000"
        if self.model.protocol == 2:
            known = ", ".join(map(str, _BAUD_CODES))
        raise InvalidInput(f"the {self.model.name} has no rate {baud}, only {known}.")

    def _max_effort(self) -> float:
        memory, model = self.memory, self.model
        top = model["pwm_limit"].upper
        shares = [memory["pwm_limit"] / top, abs(memory["goal_pwm"]) / top]
        if "goal_current" in model and memory["operating_mode"] in (0, 5):
            shares.append(abs(memory["goal_current"]) / model["current_limit"].upper)
        return min(shares)

    def _watch(self) -> None:
        """Stop if nobody has spoken for too long."""
        if "bus_watchdog" not in self.model or not self.torque:
            self._heard = self._now
            return
        limit = self.memory["bus_watchdog"] * _WATCHDOG_UNIT
        if limit > 0 and self._now - self._heard > limit:
            self.memory["bus_watchdog"] = -1
            self.motor.stop()
            self._note(f"bus watchdog: nothing heard for {limit:g} s, stopped")

    def _torque_off(self) -> None:
        if self.torque:
            self.memory["torque_enable"] = 0
            self.motor.stop()
            self._note("torque off")

    def _show(self) -> None:
        """Write what it measures into its memory."""
        motor, model = self.motor, self.model
        effort = motor.effort
        values = {
            "present_position": motor.position,
            "present_velocity": motor.velocity / model.velocity_unit,
            "present_load": 1000 * effort,
            "present_current": effort * model.stall_current / model.current_unit,
            "present_pwm": effort * model["pwm_limit"].upper,
            "present_temperature": motor.temperature,
            "present_input_voltage": 120 - 10 * abs(effort),
            "moving": abs(motor.velocity) > 10 * model.velocity_unit,
            "position_trajectory": motor.profile,
            "realtime_tick": 1000 * self._now % 32768,
            "hardware_error_status": self.memory.alert,
            "registered_instruction": self._waiting is not None,
        }
        for name, value in values.items():
            if name in model:
                self.memory[name] = int(value)

    def _note(self, text: str) -> None:
        self.events.append((self._now, text))

    def _wanted(self, packet: Packet) -> bool:
        """Whether a status goes back to the sender."""
        if packet.id == BROADCAST:
            return False
        level = self.memory["status_return_level"]
        return level == 2 or (level == 1 and packet.instruction == 0x02)

    def _reply(self, packet: Packet, turn: int, error: int, content: bytes) -> Reply:
        if self.model.protocol == 1:
            error = _ERRORS_1.get(error, 0) | (self.memory.alert & 0x25)
        elif self.memory.alert:
            error |= 0x80
        data = encode(Packet(self.id, STATUS, content, error), self.model.protocol)
        # Ten bits a byte; the instruction took its time as well.
        asked = len(packet.data) + 10
        on_wire = (asked + (turn + 1) * len(data)) * 10 / self.baud
        delay = self.memory["return_delay_time"] * 2e-6
        return Reply(self._now + delay + on_wire, data)

    def _obey(self, packet: Packet) -> list[tuple[int, int, bytes]]:
        """Do what a packet says: (turn, error, content) of the answers."""
        if packet.id not in (self.id, BROADCAST):
            return []
        if not packet.intact:
            return [(0, Trouble.CRC, b"")]
        try:
            return self._instruction(packet)
        except Trouble as trouble:
            return [(0, trouble.number, b"")]

    def _instruction(self, packet: Packet) -> list[tuple[int, int, bytes]]:
        data, wide = packet.data, self.model.protocol == 2
        size = 2 if wide else 1  # of an address or a length

        def number(at: int) -> int:
            return int.from_bytes(data[at : at + size], "little")

        match packet.instruction:
            case 0x01:
                about = self.memory.read(0, 2) + self.memory.read(6, 1) if wide else b""
                return [(0 if packet.id == self.id else self.id, 0, about)]
            case 0x02 if len(data) == 2 * size:
                return [(0, 0, self.memory.read(number(0), number(size)))]
            case 0x03 if len(data) > size:
                self._write(number(0), data[size:])
                return [(0, 0, b"")]
            case 0x04 if len(data) > size:
                self.memory.check(number(0), data[size:])
                self._waiting = data
                return [(0, 0, b"")]
            case 0x05 if self._waiting is not None:
                waiting, self._waiting = self._waiting, None
                self._write(int.from_bytes(waiting[:size], "little"), waiting[size:])
                return [(0, 0, b"")]
            case 0x08 if wide:
                self.restart()
                return [(0, 0, b"")]
            case 0x10 if wide and data == b"\x01DXL\x22":
                if self.motor.velocity:
                    raise Trouble(Trouble.FAILED)
                self.motor.position %= self.model.ticks_per_turn
                self.motor.stop()
                return [(0, 0, b"")]
            case 0x83:
                count = number(size)
                for at in range(2 * size, len(data), count + 1):
                    if data[at] == self.id:
                        self._write(number(0), data[at + 1 : at + 1 + count])
                return []
            case 0x93 if wide:
                at = 0
                while at + 5 <= len(data):
                    count = number(at + 3)
                    if data[at] == self.id:
                        self._write(number(at + 1), data[at + 5 : at + 5 + count])
                    at += 5 + count
                return []
            case 0x82 if wide and self.id in data[4:]:
                turn = data[4:].index(self.id)
                return [(turn, 0, self.memory.read(number(0), number(2)))]
            case 0x82 if wide:
                return []
            case 0x92:
                return self._bulk_read(data, wide=wide)
        # Factory reset among them: an emulator has no factory to go back to.
        raise Trouble(Trouble.INSTRUCTION)

    def _bulk_read(self, data: bytes, *, wide: bool) -> list[tuple[int, int, bytes]]:
        if wide:
            entries = [data[i : i + 5] for i in range(0, len(data), 5)]
            for turn, entry in enumerate(entries):
                if len(entry) == 5 and entry[0] == self.id:
                    address = int.from_bytes(entry[1:3], "little")
                    count = int.from_bytes(entry[3:5], "little")
                    return [(turn, 0, self.memory.read(address, count))]
            return []
        entries = [data[i : i + 3] for i in range(1, len(data), 3)]
        for turn, entry in enumerate(entries):
            if len(entry) == 3 and entry[1] == self.id:
                return [(turn, 0, self.memory.read(entry[2], entry[0]))]
        return []

    def _write(self, address: int, data: bytes) -> None:
        written = self.memory.check(address, data)
        if self.watchdog_error and any(r.name in _GOALS for r, _ in written):
            raise Trouble(Trouble.RANGE)
        for register, value in written:
            self._take(register, value)

    def _take(self, register: Register, value: int) -> None:
        if register.name == "torque_enable":
            if value and not self.torque:
                if self.memory.alert:
                    return  # until it is started again
                self.motor.stop()
                self._note("torque on")
            elif not value:
                self._torque_off()
        self.memory[register.name] = value
        if register.name == "goal_position":
            self.goals.append((self._now, value))
            # An AX-12 switches its torque on when it is told a goal.
            if self.model.protocol == 1 and not self.torque and not self.memory.alert:
                self.memory["torque_enable"] = 1
                self._note("torque on")
