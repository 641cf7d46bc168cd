"""Control tables of four Dynamixel servos, from ROBOTIS's e-Manual alone.

Source: the pages XL430-W250, XL330-M288, XM430-W350 and AX-12A, their sections "Control
Table of EEPROM Area" and "of RAM Area" and the descriptions below these. Nothing here
comes from the package under test, so that a mistake is not made twice.
"""

from typing import NamedTuple


class Register(NamedTuple):
    """One entry of a control table; what may be written is `low` to `high`."""

    name: str
    address: int
    size: int
    access: str
    initial: int
    low: int
    high: int
    sign: str  # "": none, "s": two's complement, "d": direction in bit 10

    @property
    def end(self) -> int:
        return self.address + self.size

    def pack(self, value: int) -> bytes:
        if self.sign == "d":
            value = abs(value) + (1024 if value < 0 else 0)
        return (value % 256**self.size).to_bytes(self.size, "little")

    def unpack(self, data: bytes) -> int:
        value = int.from_bytes(data, "little", signed=self.sign == "s")
        return 1024 - value if self.sign == "d" and value > 1024 else value


class Model(NamedTuple):
    """A servo: registers by name, first address of the RAM area, units."""

    protocol: int
    registers: dict[str, Register]
    ram: int
    velocity_unit: float  # ticks/s
    acceleration_unit: float  # ticks/s^2
    no_load: float  # ticks/s
    volts: int  # 0.1 V
    bauds: dict[int, float]  # by value of the baud rate register


# name address size access [initial [low high [sign]]]
XL430 = """
model_number 0 2 r 1060
model_information 2 4 r
firmware_version 6 1 r 48
id 7 1 rw 1 0 252
baud_rate 8 1 rw 1 0 7
return_delay_time 9 1 rw 250 0 254
drive_mode 10 1 rw 0 0 13
operating_mode 11 1 rw 3 0 16
secondary_id 12 1 rw 255 0 255
protocol_type 13 1 rw 2 1 2
homing_offset 20 4 rw 0 -1044479 1044479 s
moving_threshold 24 4 rw 10 0 1023
temperature_limit 31 1 rw 72 0 100
max_voltage_limit 32 2 rw 140 60 140
min_voltage_limit 34 2 rw 60 60 140
pwm_limit 36 2 rw 885 0 885
velocity_limit 44 4 rw 265 0 1023
max_position_limit 48 4 rw 4095 0 4095
min_position_limit 52 4 rw 0 0 4095
startup_configuration 60 1 rw 0 0 3
shutdown 63 1 rw 52 0 255
torque_enable 64 1 rw 0 0 1
led 65 1 rw 0 0 1
status_return_level 68 1 rw 2 0 2
registered_instruction 69 1 r
hardware_error_status 70 1 r
velocity_i_gain 76 2 rw 1000 0 16383
velocity_p_gain 78 2 rw 100 0 16383
position_d_gain 80 2 rw 4000 0 16383
position_i_gain 82 2 rw 0 0 16383
position_p_gain 84 2 rw 640 0 16383
feedforward_2nd_gain 88 2 rw 0 0 16383
feedforward_1st_gain 90 2 rw 0 0 16383
bus_watchdog 98 1 rw 0 0 127 s
goal_pwm 100 2 rw 885 -885 885 s
goal_velocity 104 4 rw 265 -1023 1023 s
profile_acceleration 108 4 rw 0 0 32767
profile_velocity 112 4 rw 0 0 32767
goal_position 116 4 rw 0 -1048575 1048575 s
realtime_tick 120 2 r
moving 122 1 r
moving_status 123 1 r
present_pwm 124 2 r 0 0 0 s
present_load 126 2 r 0 0 0 s
present_velocity 128 4 r 0 0 0 s
present_position 132 4 r 0 0 0 s
velocity_trajectory 136 4 r 0 0 0 s
position_trajectory 140 4 r 0 0 0 s
present_input_voltage 144 2 r
present_temperature 146 1 r
backup_ready 147 1 r
"""
# Both measure a current where the XL430 estimates a load.
XM430 = """
model_number 0 2 r 1020
temperature_limit 31 1 rw 80 0 100
max_voltage_limit 32 2 rw 160 95 160
min_voltage_limit 34 2 rw 95 95 160
current_limit 38 2 rw 1193 0 1193
velocity_limit 44 4 rw 200 0 1023
velocity_i_gain 76 2 rw 1920 0 16383
position_d_gain 80 2 rw 0 0 16383
position_p_gain 84 2 rw 800 0 16383
goal_current 102 2 rw 1193 -1193 1193 s
present_current 126 2 r 0 0 0 s
"""
XL330 = """
model_number 0 2 r 1200
baud_rate 8 1 rw 1 0 6
protocol_type 13 1 rw 2 2 22
temperature_limit 31 1 rw 70 0 100
max_voltage_limit 32 2 rw 70 31 70
min_voltage_limit 34 2 rw 35 31 70
current_limit 38 2 rw 1750 0 1750
velocity_limit 44 4 rw 445 0 2047
pwm_slope 62 1 rw 140 1 255
shutdown 63 1 rw 53 0 255
velocity_i_gain 76 2 rw 1600 0 16383
velocity_p_gain 78 2 rw 180 0 16383
position_d_gain 80 2 rw 0 0 16383
position_p_gain 84 2 rw 400 0 16383
goal_current 102 2 rw 1750 -1750 1750 s
goal_velocity 104 4 rw 445 -2047 2047 s
present_current 126 2 r 0 0 0 s
"""
AX12 = """
model_number 0 2 r 12
firmware_version 2 1 r 24
id 3 1 rw 1 0 253
baud_rate 4 1 rw 1 0 254
return_delay_time 5 1 rw 250 0 254
cw_angle_limit 6 2 rw 0 0 1023
ccw_angle_limit 8 2 rw 1023 0 1023
temperature_limit 11 1 rw 70 0 100
min_voltage_limit 12 1 rw 60 50 160
max_voltage_limit 13 1 rw 140 50 160
max_torque 14 2 rw 1023 0 1023
status_return_level 16 1 rw 2 0 2
alarm_led 17 1 rw 36 0 127
shutdown 18 1 rw 36 0 127
torque_enable 24 1 rw 0 0 1
led 25 1 rw 0 0 1
cw_compliance_margin 26 1 rw 1 0 255
ccw_compliance_margin 27 1 rw 1 0 255
cw_compliance_slope 28 1 rw 32 0 254
ccw_compliance_slope 29 1 rw 32 0 254
goal_position 30 2 rw 0 0 1023
moving_speed 32 2 rw 0 0 2047
torque_limit 34 2 rw 1023 0 1023
present_position 36 2 r
present_speed 38 2 r 0 0 0 d
present_load 40 2 r 0 0 0 d
present_voltage 42 1 r
present_temperature 43 1 r
registered_instruction 44 1 r
moving 46 1 r
lock 47 1 rw 0 0 1
punch 48 2 rw 32 32 1023
"""


def registers(*tables: str, without: str = "") -> dict[str, Register]:
    """Read tables; a later line replaces one of the same name."""
    found = {}
    for line in "\n".join(tables).split("\n"):
        if line:
            name, address, size, access, *rest = line.split()
            sign = rest.pop() if rest and rest[-1].isalpha() else ""
            initial, low, high = [*map(int, rest), 0, 0, 0][:3]
            found[name] = Register(
                name, int(address), int(size), access, initial, low, high, sign
            )
    found.pop(without, None)
    return found


BAUDS = (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000)


def _x(rpm: float, volts: int, table: dict[str, Register]) -> Model:
    turn, count = 4096, table["baud_rate"].high + 1
    bauds = {code: float(baud) for code, baud in enumerate(BAUDS[:count])}
    # Units of 0.229 rev/min and of 214.577 rev/min^2.
    velocity, acceleration = turn * 0.229 / 60, turn * 214.577 / 3600
    return Model(2, table, 64, velocity, acceleration, turn * rpm / 60, volts, bauds)


_AX_TURN = 1024 * 360 / 300  # ticks in a turn, of which 300 degrees can be reached

MODELS = {
    "xl430": _x(61, 120, registers(XL430)),
    "xl330": _x(104, 50, registers(XL430, XL330, without="present_load")),
    "xm430": _x(46, 120, registers(XL430, XM430, without="present_load")),
    "ax12": Model(
        1,
        registers(AX12),
        24,
        _AX_TURN * 0.111 / 60,
        0.0,
        _AX_TURN * 59 / 60,
        120,
        {code: 2_000_000 / (code + 1) for code in range(1, 255)},
    ),
}
