"""The servo that the package is tested against is itself right: by the manual.

Then ROBOTIS's SDK and our finger understand it, and our own emulator agrees with it
register by register, wherever both follow the manual.
"""

import os
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler
from hypothesis import given
from hypothesis import strategies as st
from independent_servo.packet import crc16, packet, take_packet
from independent_servo.process import ServoProcess
from independent_servo.servo import Servo
from independent_servo.tables import MODELS, Register

from ikns.finger import Finger, open_finger
from ikns.finger.emulator import Servo as Emulator
from ikns.finger.errors import NoResponse

#: ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0" and "Protocol 1.0": id, body, packet.
PUBLISHED_2 = [
    (1, "01", "FFFFFD00 01 0300 01 194E"),
    (254, "01", "FFFFFD00 FE 0300 01 3142"),
    (1, "55 00 060426", "FFFFFD00 01 0700 55 00 060426 655D"),
    (1, "02 8400 0400", "FFFFFD00 01 0700 02 84000400 1D15"),
    (1, "55 00 A6000000", "FFFFFD00 01 0800 55 00 A6000000 8CC0"),
    (1, "03 7400 00020000", "FFFFFD00 01 0900 03 740000020000 CA89"),
    (1, "55 00", "FFFFFD00 01 0400 55 00 A10C"),
    (1, "04 6800 C8000000", "FFFFFD00 01 0900 04 6800C8000000 AE8E"),
    (1, "10 01 44584C22", "FFFFFD00 01 0800 10 0144584C22 B1DC"),
]
PUBLISHED_1 = [
    (1, "01", "FFFF 01 02 01 FB"),
    (1, "02 2B 01", "FFFF 01 04 02 2B01 CC"),
    (1, "00 20", "FFFF 01 03 00 20 DB"),
    (1, "03 0C 64AA", "FFFF 01 05 03 0C64AA DC"),
    (254, "05", "FFFF FE 02 05 FA"),
]
#: Longer than anything here takes, even on a busy machine, s.
PATIENCE = 20.0


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.005)


# --- packets -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("protocol", "example"),
    [*((2, e) for e in PUBLISHED_2), *((1, e) for e in PUBLISHED_1)],
)
def test_packets_are_those_that_the_manual_prints(
    protocol: int, example: tuple[int, str, str]
) -> None:
    number, body, whole = example[0], *map(bytes.fromhex, example[1:])
    assert packet(protocol, number, body) == whole
    assert take_packet(protocol, bytearray(whole)) == (number, body, True)


@given(
    protocol=st.sampled_from([1, 2]),
    bodies=st.lists(
        st.lists(st.sampled_from([0xFF, 0xFD, 0, 3, 0x55]), min_size=1, max_size=30),
        min_size=1,
        max_size=4,
    ),
    at=st.integers(0, 200),
)
def test_packets_survive_any_bytes_and_any_cut(
    protocol: int, bodies: list[list[int]], at: int
) -> None:
    whole = b"".join(packet(protocol, 1, bytes(body)) for body in bodies)
    if protocol == 2:  # stuffing leaves no header but the real ones
        assert whole.count(b"\xff\xff\xfd\x00") == len(bodies)
    seen, found = bytearray(), []
    for part in (whole[:at], whole[at:]):
        seen += part
        while (one := take_packet(protocol, seen)) is not None:
            found.append(one)
    assert found == [(1, bytes(body), True) for body in bodies]


@given(data=st.binary(min_size=1, max_size=40), bit=st.integers(0, 319))
def test_the_crc_finds_every_single_wrong_bit(data: bytes, bit: int) -> None:
    wrong = bytearray(data)
    wrong[bit // 8 % len(data)] ^= 1 << bit % 8
    assert crc16(bytes(wrong)) != crc16(data)


# --- what the manual says that it does -----------------------------------------------


class Desk:
    """A servo with a clock, and somebody who speaks to it."""

    def __init__(self, model: str, **options: bool) -> None:
        self.now, self.events = 0.0, list[dict[str, Any]]()
        self.servo = Servo(
            model,
            clock=lambda: self.now,
            log=lambda **e: self.events.append(e),
            **options,
        )
        self.model, self.protocol = MODELS[model], MODELS[model].protocol

    def say(self, body: bytes) -> bytes:
        (answer,) = self.servo.hear(packet(self.protocol, 1, body))
        found = take_packet(self.protocol, bytearray(answer[1]))
        assert found is not None
        return found[1][self.protocol - 1 :]

    def write(self, name: str, value: int) -> int:
        return self.say(write(self.protocol, self.model.registers[name], value))[0]

    def wait(self, seconds: float, *, talking: bool = True) -> None:
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            self.say(b"\1") if talking else self.servo.pass_time()


def write(protocol: int, register: Register, value: int) -> bytes:
    place = register.address.to_bytes(protocol, "little")
    return b"\3" + place + register.pack(value)


def read(protocol: int, register: Register) -> bytes:
    numbers = (register.address, register.size)
    return b"\2" + b"".join(n.to_bytes(protocol, "little") for n in numbers)


@pytest.mark.parametrize("model", MODELS)
def test_it_holds_under_torque_coasts_without_and_keeps_its_profile(model: str) -> None:
    desk = Desk(model)
    motor, speed = desk.servo.motor, "profile_velocity"
    start, goal = motor.position, round(motor.position * 1.5)
    desk.write("moving_speed" if desk.protocol == 1 else speed, 50)
    assert desk.write("goal_position", goal) == 0
    assert desk.servo["torque_enable"] == (desk.protocol == 1)  # it comes with a goal
    desk.write("torque_enable", 1)
    desk.wait(0.3)
    # The profile's speed; a lag of first order never exceeds it.
    assert 0.9 <= motor.velocity / (50 * desk.model.velocity_unit) <= 1
    desk.write("torque_enable", 0)
    left = motor.position
    desk.wait(1.0)
    assert left < motor.position < goal
    assert abs(motor.velocity) < 1e-3
    desk.write("goal_position", round(start))
    desk.write("torque_enable", 1)
    desk.wait(5.0)
    assert motor.position == pytest.approx(start, abs=1)  # a tick
    assert desk.servo["moving"] == 0


@pytest.mark.parametrize("clears", [False, True])
def test_its_watchdog_stops_it_and_locks_goals_until_it_is_cleared(
    clears: bool,
) -> None:
    desk = Desk("xl430", clears_profile=clears)
    for name, value in {
        "profile_velocity": 50,
        "torque_enable": 1,
        "goal_position": 4000,
        "bus_watchdog": 15,  # 0.3 s
    }.items():
        assert desk.write(name, value) == 0
    desk.wait(0.5)
    assert not desk.servo.tripped
    desk.wait(0.29, talking=False)
    assert not desk.servo.tripped
    desk.wait(0.03, talking=False)
    assert desk.servo["bus_watchdog"] == -1
    stood = desk.servo.motor.position
    desk.wait(1.0, talking=False)
    assert desk.servo.motor.position - stood < 1  # ticks; the rest of the lag
    assert desk.servo["torque_enable"] == 1  # it stands still under torque
    assert desk.servo["profile_velocity"] == (0 if clears else 50)
    assert desk.write("goal_position", 2000) == 4
    assert desk.write("led", 1) == 0
    assert desk.write("bus_watchdog", 0) == 0
    assert desk.write("goal_position", 2000) == 0
    trips = [e["tripped"] for e in desk.events if e["event"] == "watchdog"]
    assert trips == [1, 0]


def test_the_eeprom_is_locked_under_torque_and_tries_are_told() -> None:
    desk = Desk("xm430")
    assert desk.write("operating_mode", 5) == 0
    desk.write("torque_enable", 1)
    assert desk.write("operating_mode", 3) == 7
    assert [
        (e["value"], e["torque"], e["error"])
        for e in desk.events
        if e["event"] == "eeprom"
    ] == [(5, 0, 0), (3, 1, 7)]


def test_alerts_take_the_torque_away_each_model_in_its_way() -> None:
    desk = Desk("xl430")
    desk.write("torque_enable", 1)
    desk.servo.raise_alert("overload")
    assert desk.say(b"\1")[0] == 0x80
    assert desk.servo["hardware_error_status"] == 1 << 5
    desk.write("torque_enable", 1)
    assert desk.servo["torque_enable"] == 0  # not before a reboot
    desk.say(b"\x08")
    desk.now += 0.5
    assert desk.write("torque_enable", 1) == 0
    assert desk.servo["torque_enable"] == 1
    desk = Desk("ax12")
    desk.write("goal_position", 900)
    desk.servo.raise_alert("overheating")
    assert desk.say(b"\1") == b"\x04"
    assert (desk.servo["torque_enable"], desk.servo["torque_limit"]) == (1, 0)
    stood = desk.servo.motor.position
    desk.wait(1.0)
    assert desk.servo.motor.position == stood


def test_it_answers_as_much_as_the_status_return_level_says() -> None:
    desk = Desk("xl430")
    level, led = (desk.model.registers[n] for n in ("status_return_level", "led"))
    for value, count in ((0, 1), (1, 2), (2, 3)):
        desk.servo.hear(packet(2, 1, write(2, level, value)))
        bodies = [b"\1", read(2, led), write(2, led, 1)]
        told = [desk.servo.hear(packet(2, 1, body)) for body in bodies]
        assert sum(map(len, told)) == count


# --- the process, and who speaks with it ---------------------------------------------


@pytest.fixture(params=["xl430", "xl330", "xm430", "ax12"])
def servo(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[ServoProcess]:
    with ServoProcess(tmp_path, model=request.param) as servo:
        yield servo


def test_robotis_own_sdk_understands_it(servo: ServoProcess) -> None:
    model = servo.model
    port = PortHandler(str(servo.port))
    talk = PacketHandler(float(model.protocol))
    assert port.openPort()
    assert port.setBaudRate(57600)
    number, result, error = talk.ping(port, 1)
    expected = model.registers["model_number"].initial
    assert (number, result, error) == (expected, COMM_SUCCESS, 0)
    goal = model.registers["goal_position"]
    written = getattr(talk, f"write{goal.size}ByteTxRx")
    assert written(port, 1, goal.address, 700) == (COMM_SUCCESS, 0)
    now = getattr(talk, f"read{goal.size}ByteTxRx")
    assert now(port, 1, goal.address) == (700, COMM_SUCCESS, 0)
    assert servo["goal_position"] == 700
    _, error = talk.write1ByteTxRx(port, 1, model.registers["moving"].address, 1)
    assert error == (7 if model.protocol == 2 else 8)  # it can only be read
    port.closePort()


@contextmanager
def connected(address: str) -> Iterator[Finger]:
    """A connected finger; a busy machine may keep the servo from answering for 1 s."""
    finger = open_finger(address)
    for last in (False, False, False, True):
        try:
            finger.connect()
            break
        except NoResponse:
            if last:
                raise
    try:
        yield finger
    finally:
        finger.relax()


@pytest.mark.parametrize("slow", [{}, {"answer_delay": 0.004}, {"byte_time": True}])
@pytest.mark.parametrize("model", ["xl430", "xm430", "ax12"])
def test_our_finger_connects_moves_and_relaxes(
    model: str, slow: dict[str, Any], tmp_path: Path
) -> None:
    with ServoProcess(tmp_path, model=model, **slow) as servo:
        address = f"dynamixel:{servo.port}?model={model}&watchdog=2"
        with connected(address) as finger:
            assert servo["torque_enable"] == 1
            start = servo["present_position"]

            def moved() -> bool:
                finger.command(0.9)
                return servo["present_position"] - start > 100

            until(moved)
        assert servo["torque_enable"] == 0
        assert [e["on"] for e in servo.events("torque")] == [1, 0]
        assert not any(e["torque"] for e in servo.events("eeprom"))
        assert not any(e["error"] for e in servo.events("goal"))


def exchange(port: Path, baud: int, data: bytes, seconds: float) -> tuple[bytes, float]:
    """Send bytes; return what comes, and how long the first took."""
    fd = os.open(port, os.O_RDWR | os.O_NOCTTY)
    speed = getattr(termios, f"B{baud}")
    settings = termios.tcgetattr(fd)
    settings[4:6] = [speed, speed]
    termios.tcsetattr(fd, termios.TCSANOW, settings)
    os.set_blocking(fd, False)
    began, first, came = time.monotonic(), float("inf"), b""
    os.write(fd, data)
    while time.monotonic() < began + seconds:
        try:
            came += os.read(fd, 100)
            first = min(first, time.monotonic() - began)
        except BlockingIOError:
            time.sleep(5e-4)
    os.close(fd)
    return came, first


PING = packet(2, 1, b"\1")


def test_bytes_and_answers_take_their_time(tmp_path: Path) -> None:
    with ServoProcess(tmp_path, answer_delay=0.02, byte_time=True) as servo:
        came, first = exchange(servo.port, 57600, PING, 0.3)
        assert len(came) == 14
        # 10 bytes there and at least 1 back of 10 bits, 0.5 ms of return delay.
        assert first >= 0.02 + 11 * 10 / 57600 + 0.0005


def test_another_baud_rate_is_noise_and_is_told(tmp_path: Path) -> None:
    with ServoProcess(tmp_path) as servo:
        assert exchange(servo.port, 115200, PING, 0.1)[0] == b""
        assert len(exchange(servo.port, 57600, PING, 0.1)[0]) == 14
        assert [e["baud"] for e in servo.events("terminal")] == [115200, 57600]


def test_it_goes_on_while_the_program_is_stopped(tmp_path: Path) -> None:
    program = (
        "import sys, time\nfrom ikns.finger import open_finger\n"
        "with open_finger(sys.argv[1]) as finger:\n"
        "    while True:\n"
        "        finger.command(time.monotonic() % 1)\n        time.sleep(0.01)\n"
    )
    with ServoProcess(tmp_path) as servo:
        argv = [sys.executable, "-c", program, f"dynamixel:{servo.port}"]
        with subprocess.Popen(argv, stderr=subprocess.DEVNULL) as process:
            until(lambda: len(servo.events("goal")) > 5)
            stopped = time.monotonic()
            process.send_signal(signal.SIGSTOP)
            until(lambda: servo["bus_watchdog"] == -1)
            # The watchdog of 0.3 s, and the longest that the servo itself sleeps.
            tripped = servo.events("watchdog")[-1]
            assert 0.3 < tripped["silent"] < 0.4
            assert tripped["t"] - stopped < 0.5
            assert servo["torque_enable"] == 1
            process.kill()


def test_faults_of_the_wire_begin_and_end_when_they_are_asked_for(
    tmp_path: Path,
) -> None:
    with ServoProcess(tmp_path) as servo:
        for fault in ("mute", "silence", "crc"):
            servo.request(do=fault, on=True)
            came, _ = exchange(servo.port, 57600, PING, 0.1)
            found = take_packet(2, bytearray(came))
            assert found is None if fault != "crc" else found and not found[2]
            servo.request(do=fault, on=False)
        servo.request(do="unplug")
        assert not servo.port.exists()
        servo.request(do="replug")
        assert len(exchange(servo.port, 57600, PING, 0.1)[0]) == 14


# --- our own emulator ----------------------------------------------------------------

# Where the emulator is known not to follow the manual, by model: what it starts with,
# what it takes, and registers that it lacks. The manual does not say what the firmware
# is, nor with which goal velocity a servo starts.
UNSAID = {"firmware_version", "goal_velocity"}
LACKING = {"startup_configuration", "backup_ready"}
WRONG = {
    "xl430": {"max_voltage_limit", "min_voltage_limit", "moving_status"},
    "xm430": {
        *("max_voltage_limit", "min_voltage_limit", "moving_status", "velocity_limit"),
        *("velocity_i_gain", "position_d_gain", "position_p_gain"),
    },
    "ax12": {
        *("max_voltage_limit", "min_voltage_limit", "temperature_limit"),
        *("cw_compliance_slope", "ccw_compliance_slope"),
    },
}
# These change how one is spoken to; they are tested above.
SPOKEN = {"id", "baud_rate", "status_return_level", "protocol_type", "drive_mode"}


@st.composite
def talks(draw: st.DrawFn) -> tuple[str, list[tuple[Register, int | None]]]:
    """A model, and registers with the value to write, or None to read."""
    model = draw(st.sampled_from(sorted(WRONG)))
    left_out = UNSAID | LACKING | WRONG[model] | SPOKEN
    known = [r for r in MODELS[model].registers.values() if r.name not in left_out]
    said = []
    for r in draw(st.lists(st.sampled_from(known), max_size=40)):
        near = st.sampled_from([r.low - 1, r.low, r.high, r.high + 1, r.initial])
        bits = 8 * r.size
        value = draw(st.none() | near | st.integers(0, 2**bits - 1))
        said.append((r, None if value is None else r.unpack(r.pack(value))))
    return model, said


@given(talk=talks())
def test_our_emulator_agrees_register_by_register(
    talk: tuple[str, list[tuple[Register, int | None]]],
) -> None:
    model, said = talk
    protocol = MODELS[model].protocol
    theirs = Servo(model, clock=lambda: 0.0)
    ours = Emulator(model, clock=lambda: 0.0)
    for register, value in said:
        eeprom = register.address < MODELS[model].ram
        if protocol == 1 and eeprom and theirs["torque_enable"]:
            continue  # the emulator locks it, the manual does not
        if value is None:
            body = read(protocol, register)
        else:
            body = write(protocol, register, value)
        data = packet(protocol, 1, body)
        (answer,) = theirs.hear(data)
        (reply,) = ours.receive(data)
        assert reply.data == answer[1], (register.name, value)
