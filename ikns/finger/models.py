"""Dynamixel models that can drive a finger: registers, units and speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ikns.errors import InvalidInput
from ikns.finger.control_table import (
    AX_SERIES,
    CURRENT_CONTROL,
    X_SERIES,
    Register,
    read_table,
)


@dataclass(frozen=True)
class Model:
    """A model of servo.

    Parameters
    ----------
    name : str
    numbers : tuple of int
        Model numbers that it responds to a ping with; several for variants that differ
        only in their gear ratio.
    protocol : {1, 2}
    registers : dict of Register
        By name.
    ticks_per_turn : float
    highest : int
        Highest position, ticks.
    velocity_unit : float
        Ticks per second in one unit of velocity.
    acceleration_unit : float
        Ticks per second squared in one unit of profile acceleration; NaN without one.
    current_unit : float
        Amperes in one unit of current; NaN where no current is measured.
    stall_current : float
        Current at full effort, A, for the emulator.
    speed : float
        No-load speed, ticks per second, for the emulator.
    """

    name: str
    numbers: tuple[int, ...]
    protocol: Literal[1, 2]
    registers: dict[str, Register]
    ticks_per_turn: float
    highest: int
    velocity_unit: float
    acceleration_unit: float
    current_unit: float
    stall_current: float
    speed: float

    def __getitem__(self, name: str) -> Register:
        """Return a register by its name."""
        return self.registers[name]

    def __contains__(self, name: str) -> bool:
        """Whether this model has a register of that name."""
        return name in self.registers

    @property
    def memory(self) -> int:
        """First address after the last register."""
        return max(register.end for register in self.registers.values())

    @property
    def ram(self) -> int:
        """First address of the RAM, which is lost without power."""
        return self["torque_enable"].address


def _x_series(
    name: str,
    numbers: tuple[int, ...],
    registers: dict[str, Register],
    *,
    rpm: float,
    stall_current: float,
    current_unit: float = math.nan,
) -> Model:
    turn = 4096.0
    return Model(
        name=name,
        numbers=numbers,
        protocol=2,
        registers=registers,
        ticks_per_turn=turn,
        highest=4095,
        velocity_unit=0.229 / 60 * turn,  # 0.229 rev/min
        acceleration_unit=214.577 / 3600 * turn,  # 214.577 rev/min^2
        current_unit=current_unit,
        stall_current=stall_current,
        speed=rpm / 60 * turn,
    )


_XM = read_table(
    X_SERIES,
    CURRENT_CONTROL,
    model_number=1020,
    temperature_limit=80,
    max_voltage_limit=160,
    min_voltage_limit=95,
    velocity_limit=350,
)
del _XM["present_load"]  # XM servos have present_current at its address

#: Servos that can drive a finger, by name.
MODELS: dict[str, Model] = {
    "xl430": _x_series(
        "xl430",
        (1060,),
        read_table(X_SERIES, model_number=1060),
        rpm=57,
        stall_current=1.3,
    ),
    "xm430": _x_series(
        "xm430",
        (1020, 1030),
        _XM,
        rpm=46,
        stall_current=2.3,
        current_unit=2.69e-3,
    ),
    "mx28": _x_series(
        "mx28",
        (30,),
        read_table(
            X_SERIES,
            model_number=30,
            temperature_limit=80,
            max_voltage_limit=160,
            min_voltage_limit=95,
            velocity_limit=380,
        ),
        rpm=55,
        stall_current=1.4,
    ),
    "ax12": Model(
        name="ax12",
        numbers=(12,),
        protocol=1,
        registers=read_table(AX_SERIES),
        ticks_per_turn=1024 * 360 / 300,  # 1024 ticks over 300 degrees
        highest=1023,
        velocity_unit=0.111 / 60 * 1024 * 360 / 300,  # 0.111 rev/min
        acceleration_unit=math.nan,
        current_unit=math.nan,
        stall_current=1.5,
        speed=59 / 60 * 1024 * 360 / 300,
    ),
}

# Bits of the hardware error status of Protocol 2.0, and of the status error of 1.0.
_ERRORS = {
    2: {
        0: "input voltage out of range",
        2: "overheating",
        3: "motor encoder fault",
        4: "electrical shock",
        5: "overload",
    },
    1: {0: "input voltage out of range", 2: "overheating", 5: "overload"},
}


def alert_text(bits: int, protocol: int) -> str:
    """Return the names of alert bits.

    >>> alert_text(0b100100, 2)
    'overheating, overload'
    """
    names = [text for bit, text in _ERRORS[protocol].items() if bits >> bit & 1]
    return ", ".join(names)


def model_named(name: str) -> Model:
    """Return a model by its name."""
    if name not in MODELS:
        raise InvalidInput(
            f"unknown servo model '{name}', expected one of {', '.join(MODELS)}."
        )
    return MODELS[name]
