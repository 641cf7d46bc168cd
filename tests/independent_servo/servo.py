"""A Dynamixel servo of another's making: bytes in, bytes out, no port and no thread.

It shares no line with the emulator of the package and is written from ROBOTIS's
e-Manual: pages "DYNAMIXEL Protocol 2.0", "Protocol 1.0" and those of the servos. Where
the manual leaves a choice, it does what is worse for the one who wears the motor.
"""

import math
import time
from collections.abc import Callable

from independent_servo.motor import Motor
from independent_servo.packet import packet, take_packet
from independent_servo.tables import MODELS, Register

__all__ = ["Servo"]

BROADCAST = 254
PING, READ, WRITE, REG_WRITE, ACTION, REBOOT, STATUS = 1, 2, 3, 4, 5, 8, 0x55
INSTRUCTION_ERROR, CRC_ERROR, RANGE, LENGTH, LIMIT, ACCESS = 2, 3, 4, 5, 6, 7
#: Bits of Protocol 1.0 for the error numbers of Protocol 2.0.
BITS = {0: 0, 2: 64, 3: 16, 4: 8, 5: 8, 6: 2, 7: 8}
ALERTS = {"voltage": 0, "overheating": 2, "encoder": 3, "shock": 4, "overload": 5}
GOALS = {"goal_pwm", "goal_current", "goal_velocity", "goal_position"}
#: Limits of goals by absolute value.
CAPS = {
    "goal_pwm": "pwm_limit",
    "goal_current": "current_limit",
    "goal_velocity": "velocity_limit",
}
#: Ours: s to boot, and s after which the start of a packet is given up.
BOOT, GIVE_UP = 0.2, 0.1


class Servo:
    """A servo; `log` is called with every event, as keywords.

    A caller gives it what arrives on the wire and lets time pass every few ms. When the
    watchdog stops it, velocity and acceleration of the profile "are set to 0" in recent
    manuals and "applied as 0" in older ones: `clears_profile` makes it the former.
    """

    def __init__(
        self,
        model: str = "xl430",
        *,
        id: int = 1,
        baud: int = 57600,
        position: float | None = None,
        clears_profile: bool = False,
        clock: Callable[[], float] = time.monotonic,
        log: Callable[..., None] = lambda **event: None,
    ) -> None:
        self.model, self._clock, self._log = MODELS[model], clock, log
        self._clears_profile = clears_profile
        self.now = self._heard = self._byte_at = clock()
        top = 4095 if self.model.protocol == 2 else 1023
        self.motor = Motor((top + 1) / 2 if position is None else position)
        self.values = {r.name: r.initial for r in self.model.registers.values()}
        self.values["id"] = id
        near = {abs(b / baud - 1): code for code, b in self.model.bauds.items()}
        self.values["baud_rate"] = near[min(near)]
        self._seen, self._waiting = bytearray(), b""
        self.start(boot=0.0)

    def __getitem__(self, name: str) -> int:
        return self.values[name]

    @property
    def baud(self) -> float:
        return self.model.bauds[self["baud_rate"]]

    @property
    def tripped(self) -> bool:
        """Whether the bus watchdog has stopped it."""
        return self.values.get("bus_watchdog") == -1

    def start(self, *, boot: float = BOOT) -> None:
        """Begin as after switching the power on: RAM has its initial values."""
        values, was = self.values, self.values["torque_enable"]
        for r in self.model.registers.values():
            if r.address >= self.model.ram:
                values[r.name] = r.initial
        for goal, limit in {**CAPS, "torque_limit": "max_torque"}.items():
            if goal in values:
                values[goal] = values[limit]
        values["goal_position"] = round(self.motor.position)
        self.alert, self._waiting = 0, b""
        self._seen.clear()
        self.motor.stop()
        self._deaf_until = self.now + boot
        if was:
            self._log(event="torque", on=0, why="start")
        self._show()

    def raise_alert(self, name: str) -> None:
        """Let something go wrong that the servo protects itself from."""
        bit, protects = 1 << ALERTS[name], self["shutdown"] >> ALERTS[name] & 1
        self.alert |= bit
        self._log(event="alert", name=name)
        if protects and self.model.protocol == 1:
            self.values["torque_limit"] = 0
        elif protects:
            self._torque(0, "alert")
        self._show()

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        """Take bytes from the wire; return answers with their delays, s."""
        self.pass_time()
        if self.now < self._deaf_until:
            return []
        if self.now - self._byte_at > GIVE_UP:
            self._seen.clear()
        self._byte_at = self.now
        self._seen += data
        answers = []
        while (found := take_packet(self.model.protocol, self._seen)) is not None:
            number, body, whole = found
            if whole:  # "all the instruction packets", whoever they are for
                self._heard = self.now
            if number not in (self["id"], BROADCAST):
                continue
            error, content = self._obey(body) if whole else (CRC_ERROR, b"")
            level, kind = self["status_return_level"], body[0]
            wanted = level == 2 or (level == 1 and kind == READ)
            if kind == PING or (wanted and number != BROADCAST):
                answers.append((2e-6 * self["return_delay_time"], error, content))
        self._show()
        return [(delay, self._status(error, what)) for delay, error, what in answers]

    def pass_time(self) -> None:
        """Move, and look at the bus watchdog."""
        before, self.now = self.now, self._clock()
        self._move(self.now - before)
        limit = 0.02 * self.values.get("bus_watchdog", 0)
        if self["torque_enable"] and limit > 0 and self.now - self._heard > limit:
            self.values["bus_watchdog"] = -1
            if self._clears_profile:
                self.values |= {"profile_velocity": 0, "profile_acceleration": 0}
            self.motor.stop()
            self._log(event="watchdog", tripped=1, silent=self.now - self._heard)
        self._show()

    def _move(self, seconds: float) -> None:
        model, values = self.model, self.values
        velocity = values.get("profile_velocity", values.get("moving_speed", 0) & 1023)
        acceleration = values.get("profile_acceleration", 0)
        self.motor.move(
            seconds,  # 0 stands for no limit
            fast=velocity * model.velocity_unit or math.inf,
            change=acceleration * model.acceleration_unit or math.inf,
            top=model.no_load * self._share() if self["torque_enable"] else 0.0,
        )

    def _share(self) -> float:
        """Share of the motor's full output that it may use."""
        if self.model.protocol == 1:
            return self["torque_limit"] / 1023
        shares = [abs(self["goal_pwm"]) / 885, self["pwm_limit"] / 885]
        if "goal_current" in self.values and self["operating_mode"] in (0, 5):
            most = self.model.registers["current_limit"].high
            shares += [abs(self["goal_current"]) / most, self["current_limit"] / most]
        return min(shares)

    def _status(self, error: int, content: bytes) -> bytes:
        if self.model.protocol == 1:
            head = bytes([BITS[error] | self.alert])
        else:
            head = bytes([STATUS, error | (0x80 if self.alert else 0)])
        return packet(self.model.protocol, self["id"], head + content)

    def _obey(self, body: bytes) -> tuple[int, bytes]:
        size, kind, rest = self.model.protocol, body[0], body[1:]
        place = int.from_bytes(rest[:size], "little")
        if kind == PING:
            wide = self.model.protocol == 2
            return 0, self._bytes(0, 2) + self._bytes(6, 1) if wide else b""
        if kind == READ and len(rest) == 2 * size:
            count = int.from_bytes(rest[size:], "little")
            last = max(r.end for r in self.model.registers.values())
            inside = 0 < count and place + count <= last
            return (0, self._bytes(place, count)) if inside else (ACCESS, b"")
        if kind in (WRITE, REG_WRITE) and len(rest) > size:
            hit, error = self._check(place, rest[size:])
            if kind == REG_WRITE and not error:
                self._waiting = rest
            for register, value in hit if kind == WRITE else ():
                self._set(register, value, error)
            return error, b""
        if kind == ACTION and self._waiting:
            rest, self._waiting = self._waiting, b""
            return self._obey(bytes([WRITE]) + rest)
        if kind == REBOOT and self.model.protocol == 2:
            self.start()
            return 0, b""
        return INSTRUCTION_ERROR, b""

    def _bytes(self, address: int, count: int) -> bytes:
        """Bytes of memory; between the registers, as servos do, zero."""
        memory = bytearray(address + count + 4)
        for r in self.model.registers.values():
            if r.address < address + count:
                memory[r.address : r.end] = r.pack(self[r.name])
        return bytes(memory[address : address + count])

    def _check(
        self, address: int, data: bytes
    ) -> tuple[list[tuple[Register, int]], int]:
        """Registers and values that a write is about, and why it is refused, or 0."""
        hit, error, end, at = [], 0, address + len(data), address
        table = sorted(self.model.registers.values(), key=lambda r: r.address)
        for r in (r for r in table if r.address < end and r.end > address):
            if r.address > at:
                error = error or ACCESS  # something between that is no register
            if r.address < address or r.end > end:
                return hit, error or LENGTH
            at = r.end
            hit.append((r, r.unpack(data[r.address - address : r.end - address])))
            error = error or self._refusal(*hit[-1])
        return hit, error if at == end else error or ACCESS

    def _refusal(self, r: Register, value: int) -> int:
        locked = r.address < self.model.ram and (
            self["torque_enable"] if self.model.protocol == 2 else self["lock"]
        )
        if r.access == "r" or locked or (r.name == "lock" and self[r.name]):
            return ACCESS
        if not r.low <= value <= r.high or (self.tripped and r.name in GOALS):
            return RANGE
        if self.tripped and r.name == "bus_watchdog" and value:
            return RANGE  # it is cleared with 0
        if r.name in CAPS and abs(value) > self[CAPS[r.name]]:
            return LIMIT
        if r.name == "goal_position":
            low, high = self.limits
            return 0 if low <= value <= high else LIMIT
        return 0

    @property
    def limits(self) -> tuple[int, int]:
        """Positions that may be its goal."""
        if self.model.protocol == 1:
            return self["cw_angle_limit"], self["ccw_angle_limit"]
        if self["operating_mode"] == 3:
            return self["min_position_limit"], self["max_position_limit"]
        return -1_048_575, 1_048_575

    def _set(self, r: Register, value: int, error: int) -> None:
        torque = self["torque_enable"]
        if r.address < self.model.ram:
            about = {"name": r.name, "value": value}
            self._log(event="eeprom", **about, torque=torque, error=error)
        if r.name == "goal_position":
            about = {"goal": value, "limits": self.limits}
            self._log(event="goal", **about, torque=torque, error=error)
        if error:
            return
        if r.name == "bus_watchdog" and self.tripped:
            self._log(event="watchdog", tripped=0)
        if r.name == "torque_enable":
            self._torque(value, "write")
            return
        self.values[r.name] = value
        if r.name == "goal_position":
            self.motor.goal = float(value)
            by_goal = self.model.protocol == 1 or self["drive_mode"] & 8
            if by_goal:  # a goal switches the torque on
                self._torque(1, "goal")

    def _torque(self, on: int, why: str) -> None:
        if on and self.model.protocol == 2 and self.alert & self["shutdown"]:
            return  # only a reboot gives it back
        if on and not self["torque_enable"]:
            at = self.motor.position
            self.motor.begin(at if self.tripped else float(self["goal_position"]))
        if on != self["torque_enable"]:
            self._log(event="torque", on=on, why=why)
        self.values["torque_enable"] = on

    def _show(self) -> None:
        """Put what it measures into its registers."""
        motor, unit = self.motor, self.model.velocity_unit
        under_way = bool(self["torque_enable"]) and motor.under_way
        speed = round(motor.velocity / unit)
        threshold = self.values.get("moving_threshold", 0)
        shown = {
            "present_position": round(motor.position),
            "present_velocity": speed,
            "present_speed": max(-1023, min(speed, 1023)),
            "present_voltage": self.model.volts,
            "present_input_voltage": self.model.volts,
            "present_temperature": 30,
            "position_trajectory": round(motor.planned),
            "velocity_trajectory": round(motor.planned_velocity / unit),
            "moving": int(under_way or abs(speed) > threshold),
            "moving_status": int(not under_way) | int(under_way) << 1,
            "realtime_tick": int(1000 * self.now) % 32768,
            "hardware_error_status": self.alert,
            "registered_instruction": int(bool(self._waiting)),
        }
        self.values |= {k: v for k, v in shown.items() if k in self.values}
