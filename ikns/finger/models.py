"""Dynamixel servos: where each value lies in their memory, and its unit.

Source: the ROBOTIS e-Manual's page of each servo, sections "Control Table of EEPROM
Area" and "of RAM Area". Names are those of Protocol 2.0; the AX-12's tables call
``min_position_limit`` CW angle limit, ``pwm_limit`` max torque, ``goal_pwm`` torque
limit and ``profile_velocity`` moving speed, which do the same there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from ikns.errors import InvalidInput

__all__ = ["MODELS", "Model", "Register", "alert_text", "model_named"]

#: How negative values are written: not at all, two's complement, or a sign in bit 10.
Sign = Literal["none", "two", "bit10"]


@dataclass(frozen=True)
class Register:
    """One value in a servo's memory.

    Parameters
    ----------
    name : str
    address, size : int
        Bytes.
    writable : bool
    initial : int
    lower, upper : int
        What may be written.
    sign : {"none", "two", "bit10"}
    """

    name: str
    address: int
    size: int
    writable: bool
    initial: int
    lower: int
    upper: int
    sign: Sign = "none"

    @property
    def end(self) -> int:
        """First address after it."""
        return self.address + self.size

    def to_bytes(self, value: int) -> bytes:
        """Bytes of a value, lowest first."""
        if self.sign == "bit10":
            value = abs(value) | (1024 if value < 0 else 0)
        return (value % (1 << 8 * self.size)).to_bytes(self.size, "little")

    def from_bytes(self, data: bytes) -> int:
        """Value of bytes.

        >>> Register("position", 132, 4, False, 0, 0, 0, "two").from_bytes(bytes(4))
        0
        """
        value = int.from_bytes(data, "little", signed=self.sign == "two")
        if self.sign == "bit10" and value & 1024:
            return -(value & 1023)
        return value


@dataclass(frozen=True)
class Model:
    """A kind of servo.

    Parameters
    ----------
    name : str
    numbers : tuple of int
        Model numbers that it answers a ping with; several for variants that differ in
        gear ratio only.
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
        Amperes at full effort, for the emulator.
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
        """Whether this model has a register."""
        return name in self.registers

    @property
    def memory(self) -> int:
        """First address after the last register."""
        return max(register.end for register in self.registers.values())

    @property
    def ram(self) -> int:
        """First address that is lost with the power, and writable with torque on."""
        return self["torque_enable"].address


# address size name access initial lowest highest [sign]
_X = """
  0 2 model_number           r  0 0 0
  2 4 model_information      r  0 0 0
  6 1 firmware_version       r 46 0 0
  7 1 id                     rw 1 0 252
  8 1 baud_rate              rw 1 0 7
  9 1 return_delay_time      rw 250 0 254
 10 1 drive_mode             rw 0 0 13
 11 1 operating_mode         rw 3 0 16
 12 1 shadow_id              rw 255 0 255
 13 1 protocol_type          rw 2 1 2
 20 4 homing_offset          rw 0 -1044479 1044479 two
 24 4 moving_threshold       rw 10 0 1023
 31 1 temperature_limit      rw 72 0 100
 32 2 max_voltage_limit      rw 140 60 160
 34 2 min_voltage_limit      rw 60 60 160
 36 2 pwm_limit              rw 885 0 885
 44 4 velocity_limit         rw 265 0 1023
 48 4 max_position_limit     rw 4095 0 4095
 52 4 min_position_limit     rw 0 0 4095
 63 1 shutdown               rw 52 0 255
 64 1 torque_enable          rw 0 0 1
 65 1 led                    rw 0 0 1
 68 1 status_return_level    rw 2 0 2
 69 1 registered_instruction r  0 0 0
 70 1 hardware_error_status  r  0 0 0
 76 2 velocity_i_gain        rw 1000 0 16383
 78 2 velocity_p_gain        rw 100 0 16383
 80 2 position_d_gain        rw 4000 0 16383
 82 2 position_i_gain        rw 0 0 16383
 84 2 position_p_gain        rw 640 0 16383
 88 2 feedforward_2nd_gain   rw 0 0 16383
 90 2 feedforward_1st_gain   rw 0 0 16383
 98 1 bus_watchdog           rw 0 0 127 two
100 2 goal_pwm               rw 885 -885 885 two
104 4 goal_velocity          rw 0 -1023 1023 two
108 4 profile_acceleration   rw 0 0 32767
112 4 profile_velocity       rw 0 0 32767
116 4 goal_position          rw 0 -1048575 1048575 two
120 2 realtime_tick          r  0 0 0
122 1 moving                 r  0 0 0
123 1 moving_status          r  0 0 0
124 2 present_pwm            r  0 0 0 two
126 2 present_load           r  0 0 0 two
128 4 present_velocity       r  0 0 0 two
132 4 present_position       r  0 0 0 two
136 4 velocity_trajectory    r  0 0 0 two
140 4 position_trajectory    r  0 0 0 two
144 2 present_input_voltage  r  0 0 0
146 1 present_temperature    r  0 0 0
"""
_CURRENT = """
 38 2 current_limit          rw 1193 0 1193
102 2 goal_current           rw 1193 -1193 1193 two
126 2 present_current        r  0 0 0 two
"""
_AX = """
 0 2 model_number            r  12 0 0
 2 1 firmware_version        r  24 0 0
 3 1 id                      rw 1 0 253
 4 1 baud_rate               rw 1 0 254
 5 1 return_delay_time       rw 250 0 254
 6 2 min_position_limit      rw 0 0 1023
 8 2 max_position_limit      rw 1023 0 1023
11 1 temperature_limit       rw 70 0 70
12 1 min_voltage_limit       rw 60 50 250
13 1 max_voltage_limit       rw 140 50 250
14 2 pwm_limit               rw 1023 0 1023
16 1 status_return_level     rw 2 0 2
17 1 alarm_led               rw 36 0 127
18 1 shutdown                rw 36 0 127
24 1 torque_enable           rw 0 0 1
25 1 led                     rw 0 0 1
26 1 cw_compliance_margin    rw 1 0 255
27 1 ccw_compliance_margin   rw 1 0 255
28 1 cw_compliance_slope     rw 32 0 255
29 1 ccw_compliance_slope    rw 32 0 255
30 2 goal_position           rw 0 0 1023
32 2 profile_velocity        rw 0 0 2047
34 2 goal_pwm                rw 1023 0 1023
36 2 present_position        r  0 0 0
38 2 present_velocity        r  0 0 0 bit10
40 2 present_load            r  0 0 0 bit10
42 1 present_input_voltage   r  0 0 0
43 1 present_temperature     r  0 0 0
44 1 registered_instruction  r  0 0 0
46 1 moving                  r  0 0 0
47 1 lock                    rw 0 0 1
48 2 punch                   rw 32 32 1023
"""


def _registers(*tables: str, **initial: int) -> dict[str, Register]:
    made: dict[str, Register] = {}
    for line in "".join(tables).split("\n"):
        if not line:
            continue
        address, size, name, access, *numbers = line.split()
        sign: Sign = "none"
        if numbers[3:] == ["two"]:
            sign = "two"
        elif numbers[3:] == ["bit10"]:
            sign = "bit10"
        first, lower, upper = map(int, numbers[:3])
        made[name] = Register(
            name, int(address), int(size), "w" in access, first, lower, upper, sign
        )
    for name, value in initial.items():
        made[name] = replace(made[name], initial=value)
    return made


def _x(
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


_XM = {k: v for k, v in _registers(_X, _CURRENT).items() if k != "present_load"}

#: Servos that can drive a finger, by name.
MODELS: dict[str, Model] = {
    "xl430": _x(
        "xl430", (1060,), _registers(_X, model_number=1060), rpm=57, stall_current=1.3
    ),
    "xm430": _x(
        "xm430",
        (1020, 1030),
        {
            **_XM,
            **{
                name: replace(_XM[name], initial=value)
                for name, value in {
                    "model_number": 1020,
                    "temperature_limit": 80,
                    "max_voltage_limit": 160,
                    "min_voltage_limit": 95,
                    "velocity_limit": 350,
                }.items()
            },
        },
        rpm=46,
        stall_current=2.3,
        current_unit=2.69e-3,
    ),
    "mx28": _x(
        "mx28",
        (30,),
        _registers(
            _X,
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
        registers=_registers(_AX),
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
    """Say what a servo complains of.

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
