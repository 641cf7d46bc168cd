"""Control tables of Dynamixel servos: address, size and range of each register.

Source: the ROBOTIS e-Manual's page of each servo, sections "Control Table of EEPROM
Area" and "of RAM Area". Names are those of Protocol 2.0; the AX-12's tables call
``min_position_limit`` CW angle limit, ``pwm_limit`` max torque, ``goal_pwm`` torque
limit and ``profile_velocity`` moving speed, which do the same there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

#: Encoding of negative values: none, two's complement, or a sign in bit 10.
Sign = Literal["none", "two", "bit10"]


@dataclass(frozen=True)
class Register:
    """One register of a servo.

    Parameters
    ----------
    name : str
    address, size : int
        Bytes.
    writable : bool
    initial : int
    lower, upper : int
        Range of values that may be written.
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
        """First address after the register."""
        return self.address + self.size

    def to_bytes(self, value: int) -> bytes:
        """Encode a value, least significant byte first."""
        if self.sign == "bit10":
            value = abs(value) | (1024 if value < 0 else 0)
        return (value % (1 << 8 * self.size)).to_bytes(self.size, "little")

    def from_bytes(self, data: bytes) -> int:
        """Decode a value.

        >>> Register("position", 132, 4, False, 0, 0, 0, "two").from_bytes(bytes(4))
        0
        """
        value = int.from_bytes(data, "little", signed=self.sign == "two")
        if self.sign == "bit10" and value & 1024:
            return -(value & 1023)
        return value


# Columns: address size name access initial lower upper [sign]
X_SERIES = """
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
#: What models with current control have in addition.
CURRENT_CONTROL = """
 38 2 current_limit          rw 1193 0 1193
102 2 goal_current           rw 1193 -1193 1193 two
126 2 present_current        r  0 0 0 two
"""
AX_SERIES = """
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


def read_table(*tables: str, **initial: int) -> dict[str, Register]:
    """Return the registers of control tables by name, some with other initial values.

    >>> read_table(X_SERIES, model_number=1060)["goal_position"].address
    116
    """
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
