"""Control table of a simulated servo, with the rules of its firmware."""

from __future__ import annotations

import math

from ikns.finger.control_table import Register
from ikns.finger.models import Model


class StatusError(Exception):
    """Error number for the status packet (Protocol 2.0)."""

    FAILED, INSTRUCTION, CRC, RANGE, LENGTH, LIMIT, ACCESS = range(1, 8)

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Memory:
    """Register values by name, and bytes by address.

    Parameters
    ----------
    model : Model

    Attributes
    ----------
    alert : int
        Bits of the hardware error status, also for models without such a register.

    Examples
    --------
    >>> from ikns.finger.models import MODELS
    >>> memory = Memory(MODELS["xl430"])
    >>> int.from_bytes(memory.read(0, 2), "little")  # model number
    1060
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._values = {r.name: r.initial for r in model.registers.values()}
        self._by_address = sorted(model.registers.values(), key=lambda r: r.address)
        self.alert = 0

    def __getitem__(self, name: str) -> int:
        """Return the value of a register."""
        return self._values[name]

    def __setitem__(self, name: str, value: int) -> None:
        """Set a register, as the servo itself may."""
        self._values[name] = value

    def reset_ram(self) -> None:
        """Reset the RAM area to its initial values."""
        for register in self._by_address:
            if register.address >= self._model.ram:
                self._values[register.name] = register.initial
        self.alert = 0

    def read(self, address: int, count: int) -> bytes:
        """Return bytes from an address; gaps between registers read as zero.

        Raises
        ------
        StatusError
            When they are outside the control table.
        """
        if count < 1 or address + count > self._model.memory:
            raise StatusError(StatusError.ACCESS)
        data = bytearray(count)
        for register in self._by_address:
            if register.end <= address or register.address >= address + count:
                continue
            value = register.to_bytes(self._values[register.name])
            for i, byte in enumerate(value, register.address - address):
                if 0 <= i < count:
                    data[i] = byte
        return bytes(data)

    def motion_limits(self) -> tuple[float, float, float]:
        """Limits that the registers set on motion.

        Returns
        -------
        rate, acceleration : float
            Ticks per second (squared); infinite without a limit.
        max_effort : float
            Share of full effort.
        """
        model, values = self._model, self._values
        rate = values["profile_velocity"] * model.velocity_unit or math.inf
        acceleration = math.inf
        if "profile_acceleration" in model:
            acceleration = values["profile_acceleration"] or math.inf
            acceleration *= model.acceleration_unit
        top = model["pwm_limit"].upper
        shares = [values["pwm_limit"] / top, abs(values["goal_pwm"]) / top]
        if "goal_current" in model and values["operating_mode"] in (0, 5):
            shares.append(abs(values["goal_current"]) / model["current_limit"].upper)
        return rate, acceleration, min(shares)

    def check(self, address: int, data: bytes) -> list[tuple[Register, int]]:
        """Return the registers and values that bytes would write.

        Raises
        ------
        StatusError
            When the firmware would reject any of them; then none may be written.
        """
        end = address + len(data)
        hit = [r for r in self._by_address if r.address < end and r.end > address]
        if not hit or end > self._model.memory:
            raise StatusError(StatusError.ACCESS)
        written = []
        for register in hit:
            if register.address < address or register.end > end:
                raise StatusError(StatusError.LENGTH)
            eeprom = register.address < self._model.ram
            if not register.writable or (eeprom and self._values["torque_enable"]):
                raise StatusError(StatusError.ACCESS)
            start = register.address - address
            value = register.from_bytes(data[start : start + register.size])
            if not register.lower <= value <= register.upper:
                raise StatusError(StatusError.RANGE)
            self._check_limit(register.name, value)
            written.append((register, value))
        return written

    def _check_limit(self, name: str, value: int) -> None:
        values = self._values
        # Only plain position control obeys the position limits.
        if name == "goal_position" and values.get("operating_mode", 3) == 3:
            low, high = values["min_position_limit"], values["max_position_limit"]
            if not low <= value <= high:
                raise StatusError(StatusError.LIMIT)
        limit = {
            "goal_pwm": "pwm_limit",
            "goal_current": "current_limit",
            "goal_velocity": "velocity_limit",
        }.get(name)
        if limit is not None and abs(value) > values[limit]:
            raise StatusError(StatusError.LIMIT)
