"""The Dynamixel finger against a simulated servo, byte for byte, in real time.

Times are bounded by what the mechanism promises and by what a busy machine may add:
every wait below ends as soon as what is waited for is there.
"""

import math
import os
import re
import signal
import subprocess
import sys
import termios
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from ikns.finger import DynamixelFinger, FingerError, Safety, check_finger, open_finger
from ikns.finger.emulator import Servo, Wire
from ikns.finger.laws import LAWS

#: Longer than anything here takes, seconds.
TIMEOUT = 60.0


def wait_for(condition, timeout=TIMEOUT):
    """Seconds until it holds."""
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > timeout:
            pytest.fail("it did not happen in time")
        time.sleep(0.002)
    return time.monotonic() - began


def stream(finger, target, duration):
    end = time.monotonic() + duration
    sent = math.nan
    while time.monotonic() < end:
        sent = finger.command(target)
        time.sleep(0.005)
    return sent


@pytest.fixture
def servo():
    return Servo("xl430", baud=1_000_000)


@pytest.fixture
def wire(servo, tmp_path):
    with Wire(servo, link=tmp_path / "bus") as wire:
        yield wire


def finger_on(wire, **options):
    servo = wire.servos[0]
    options = {"model": servo.model.name, "baud": round(servo.baud)} | options
    return DynamixelFinger(wire.port, **options)


@pytest.mark.parametrize("model", ["xl430", "ax12"])  # Protocols 2.0 and 1.0
def test_it_keeps_the_laws(model):
    with Wire(Servo(model, baud=1_000_000)) as wire:
        for _ in range(5):
            # A busy machine must not look like a caller that hangs. Where it pauses
            # between two readings of the clock, a law seems broken, but not each time.
            report = check_finger(lambda: finger_on(wire, watchdog=1.0), strict=False)
            if not report.broken:
                break
    assert (report.kept, report.broken) == (tuple(LAWS), {})


def test_it_moves_the_servo_and_leaves_it_without_torque(servo, wire):
    with finger_on(wire) as finger:
        assert servo.torque
        assert stream(finger, 0.9, 1.0) == pytest.approx(0.9, abs=finger.resolution)
        # 1024 to 3072 ticks; the profile ends where it is told, to the tick.
        wait_for(lambda: abs(servo.motor.position - (1024 + 0.9 * 2048)) < 2)
        stream(finger, 0.9, 0.1)
        state = finger.state()
        assert state.flexion == pytest.approx(0.9, abs=2 * finger.resolution)
        assert (state.mode, state.alert) == ("active", "")
        assert state.voltage == pytest.approx(12.0, abs=0.1)  # one unit
        assert math.isnan(state.current)  # this one measures none
    assert not servo.torque
    assert finger.state().mode == "relaxed"


def test_closed_may_be_the_lower_end(servo, wire):
    with finger_on(wire, open_ticks=3000, closed_ticks=1500) as finger:
        stream(finger, 1.0, 1.0)
        wait_for(lambda: abs(servo.motor.position - 1500) < 2)


def test_connecting_does_not_move_it(servo, wire):
    servo.motor.position = servo.motor.profile = 1500.0
    servo.memory["goal_position"] = 3000  # left over from somebody else
    with finger_on(wire):
        time.sleep(0.2)
        assert servo.motor.position == pytest.approx(1500, abs=1)
    assert [ticks for _, ticks in servo.goals] == [1500]


def test_limits_are_written_into_the_servo_and_only_once(servo, wire):
    def kept():
        names = ("min_position_limit", "max_position_limit", "pwm_limit", "drive_mode")
        return [servo.memory[name] for name in names]

    servo.memory["drive_mode"] = 8  # torque by goal alone
    safety = Safety()
    with finger_on(wire, open_ticks=1000, closed_ticks=2000, effort=0.4, safety=safety):
        assert kept() == [1000, 2000, round(0.4 * 885), 0]
        assert servo.memory["bus_watchdog"] == 15  # 0.3 s in steps of 20 ms
        # Twice the half turn's rate, and half as much again to stay out of the way.
        speed = servo.memory["profile_velocity"] * servo.model.velocity_unit
        assert 3.0 * 1000 <= speed <= 3.0 * 1000 + servo.model.velocity_unit
    assert servo.memory["bus_watchdog"] == 0


def test_current_is_limited_where_it_is_measured():
    servo = Servo("xm430", baud=1_000_000)
    servo.motor.obstacles = (-math.inf, 2048.0)
    with Wire(servo) as wire, finger_on(wire, effort=0.2) as finger:
        stream(finger, 1.0, 0.6)
        current = finger.state().current
        assert servo.memory["operating_mode"] == 5
    # A fifth of what the servo gives at most, in whole units of 2.69 mA.
    assert current == pytest.approx(0.2 * 2.3, abs=2 * 2.69e-3)


def test_pushing_against_something_becomes_a_light_grip(servo, wire):
    servo.motor.obstacles = (-math.inf, 2048.0)
    safety = Safety(stall_timeout=0.2)
    with finger_on(wire, safety=safety) as finger:
        stream(finger, 1.0, 1.0)
        state = finger.state()
        assert state.stalled
        assert state.mode == "active"
        assert state.sent == pytest.approx(0.5 + safety.grip, abs=2 * finger.resolution)


def longest_command_on_a_silent_bus(wire):
    with finger_on(wire) as finger:
        wire.inject("silence")
        longest = 0.0
        for _ in range(40):
            began = time.monotonic()
            finger.command(1.0)
            finger.state()
            longest = max(longest, time.monotonic() - began)
            time.sleep(0.005)
        wire.clear_faults()
    return longest


def test_commands_do_not_wait_for_a_silent_bus(servo, wire):
    # A question without an answer blocks 35 ms and four of them 140, each time; a busy
    # scheduler lets one of many commands wait, but hardly in each of ten tries.
    assert any(longest_command_on_a_silent_bus(wire) < 0.1 for _ in range(10))


FAULTS = "silence mute delay crc id alert overheat power unplug".split()
#: While these last, nothing can switch the torque off; what stops the motor of a servo
#: with Protocol 2.0 meanwhile is its own watchdog.
UNREACHABLE = ("silence", "unplug")
#: Model, bits per second, and seconds until it answers.
SLOW = [("xl430", 1_000_000, 0.0), ("xl430", 57_600, 0.01), ("ax12", 1_000_000, 0.004)]


@pytest.mark.parametrize(("model", "baud", "late"), SLOW)
@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_at_any_instant_ends_without_torque(
    fault, model, baud, late, tmp_path
):
    rng = np.random.default_rng([len(model), *fault.encode()])
    servo = Servo(model, baud=baud)
    low, high = (1024, 3072) if model == "xl430" else (205, 819)  # a quarter turn
    with Wire(servo, link=tmp_path / "bus", answer_delay=late) as wire:
        finger = finger_on(wire)
        finger.connect()
        stream(finger, rng.uniform(), rng.uniform(0.02, 0.2))
        before = len(servo.goals)
        wire.inject(fault)
        flexion = rng.uniform()

        def safe():
            finger.command(flexion)
            stopped = not servo.torque
            if fault in UNREACHABLE:
                stopped |= servo.watchdog_error or model == "ax12"
            return finger.state().mode == "safe" and stopped

        # Silence is noticed after 0.25 s, the watchdog after 0.3 s; the rest is a
        # generous share for a busy machine.
        assert wait_for(safe) < 2.0
        goals = list(servo.goals)
        assert all(low <= ticks <= high for _, ticks in goals)
        wait_for(lambda: servo.motor.velocity == 0)
        stood = servo.motor.position
        for _ in range(10):
            finger.command(1.0 - flexion)
            time.sleep(0.01)
        assert len(servo.goals) == len(goals) >= before
        assert servo.motor.position == pytest.approx(stood, abs=0.01)
        assert finger.state().alert != ""
        wire.clear_faults()
        # Limp means that the register says so, before anyone relaxes it.
        wait_for(lambda: not servo.torque)
        assert finger.state().mode == "safe"
        finger.relax()
        assert not servo.torque


@pytest.mark.parametrize("safe_state", ["hold", "open"])
def test_after_silence_it_is_taken_up_again_in_its_safe_state(servo, wire, safe_state):
    with finger_on(wire, safety=Safety(safe_state=safe_state)) as finger:
        stream(finger, 0.8, 0.6)
        wire.inject("silence", duration=0.6)
        wait_for(lambda: finger.command(0.1) and finger.state().mode == "safe")
        wait_for(lambda: servo.watchdog_error)
        stood = servo.motor.position
        wait_for(lambda: servo.torque and not servo.watchdog_error)
        if safe_state == "open":
            wait_for(lambda: servo.motor.position < 1024 + 5)
        else:
            time.sleep(0.3)
            assert servo.motor.position == pytest.approx(stood, abs=5)
        assert finger.state().mode == "safe"
        finger.connect()
        assert finger.state().mode == "active"


def taken_up(finger):
    finger.connect()
    stream(finger, 0.2, 0.1)
    return finger.state().mode == "active"


def test_a_port_that_comes_back_is_taken_up_again(servo, wire):
    with finger_on(wire) as finger:
        stream(finger, 0.8, 0.2)
        wire.inject("unplug", duration=0.5)
        wait_for(lambda: not wire.plugged)
        wait_for(lambda: finger.command(0.8) != 0 and finger.state().mode == "safe")
        wait_for(lambda: wire.plugged)
        wait_for(lambda: not servo.torque)  # limp: told so as soon as it is back
        # A busy machine may keep the servo silent for longer than a finger waits.
        wait_for(lambda: taken_up(finger))


def test_a_port_that_comes_back_without_answers_is_reported_to_switch_torque_off(
    servo, wire
):
    # Questions alone would keep the servo's watchdog content, and it under torque.
    with finger_on(wire, watchdog=2.0) as finger:
        stream(finger, 0.8, 0.1)
        wire.inject("mute")
        wire.inject("unplug", duration=0.1)
        wait_for(lambda: not servo.torque)
        assert not servo.watchdog_error
        assert finger.state().mode == "safe"
        wire.clear_faults()


def test_torque_that_comes_on_in_the_limp_state_goes_off_again(servo, wire):
    with finger_on(wire) as finger:
        finger.make_safe("a test")
        wait_for(lambda: not servo.torque)
        for _ in range(3):
            servo.memory["torque_enable"] = 1  # as another program may write
            assert wait_for(lambda: not servo.torque) < 1.0  # it looks each 0.1 s


def test_torque_that_is_not_confirmed_off_in_the_safe_state_is_reported(servo, wire):
    with finger_on(wire) as finger:
        wire.inject("mute")
        wait_for(lambda: finger.command(0.5) and finger.state().mode == "safe")
        wait_for(lambda: "cut its power" in finger.state().alert)
        assert finger.state().alert.startswith("no answer from the servo for 0.25 s; ")
        wire.clear_faults()
        wait_for(lambda: "cut its power" not in finger.state().alert)


def test_settings_that_another_program_changes_are_restored(servo, wire):
    with finger_on(wire) as finger:
        stream(finger, 0.8, 0.1)
        with Path(wire.port).open("rb", buffering=0) as stranger:
            before = termios.tcgetattr(stranger)
            changed = [*before[:4], termios.B9600, termios.B9600, before[6]]
            termios.tcsetattr(stranger, termios.TCSANOW, changed)
            # Looked at in each cycle of 10 ms, or after a question without an answer.
            assert wait_for(lambda: termios.tcgetattr(stranger) == before) < 0.3
        wait_for(lambda: finger.command(0.8) and not servo.torque)
        state = finger.state()
        assert state.mode == "safe"
        assert state.alert == "another program changed the settings of the port"


def test_an_exception_in_any_thread_makes_it_safe(wire):
    said = []
    before, threading.excepthook = threading.excepthook, said.append
    try:
        with finger_on(wire) as finger:
            thread = threading.Thread(target=int, args=("x",), name="mine")
            thread.start()
            thread.join()
            assert finger.state().mode == "safe"
            assert finger.state().alert == "an exception ended the thread 'mine'"
        assert threading.excepthook == said.append
    finally:
        threading.excepthook = before
    assert [about.exc_type for about in said] == [ValueError]


def test_connecting_again_in_vain_leaves_it_doing_nothing(servo, wire):
    with finger_on(wire) as finger:
        stream(finger, 0.8, 0.1)
        wire.inject("silence")
        with pytest.raises(FingerError, match=r"does not answer"):
            finger.connect()
        assert finger.state().mode == "relaxed"
        assert math.isnan(finger.command(1.0))
        assert servo.torque  # still, as far as anybody knows
        wire.clear_faults()
    assert not servo.torque


def test_torque_that_is_not_confirmed_off_is_reported(servo, wire, monkeypatch):
    monkeypatch.setattr("ikns.finger.dynamixel._RELAX_TIMEOUT", 0.2)
    finger = finger_on(wire)
    finger.connect()
    wire.inject("mute")
    for _ in range(2):  # it tries again
        with pytest.raises(FingerError, match=r"did not confirm that its torque is of"):
            finger.relax()
    wire.clear_faults()
    finger.relax()
    assert not servo.torque
    finger.relax()  # harmless
    with finger:
        assert servo.torque


def test_torque_left_on_is_switched_off_when_asked_again(servo, wire, monkeypatch):
    monkeypatch.setattr("ikns.finger.dynamixel._RELAX_TIMEOUT", 0.2)
    finger = finger_on(wire, watchdog=2.54)
    finger.connect()
    wire.inject("silence")
    with pytest.raises(FingerError, match=r"did not confirm"):
        finger.relax()
    assert servo.torque
    wire.clear_faults()
    finger.relax()
    assert not servo.torque


def test_an_exception_is_not_hidden_by_one_of_relaxing(wire):
    finger = finger_on(wire)

    def fail():
        with finger:
            wire.inject("mute")
            raise KeyError("mine")

    with pytest.raises(KeyError) as caught:
        fail()
    assert "did not confirm" in caught.value.__notes__[0]
    wire.clear_faults()
    finger.relax()


class TestRefusals:
    """One sentence that says what is there, and the servo as it was."""

    def refused(self, wire, sentence, **options):
        servo = wire.servos[0]
        before = dict(servo.memory._values)
        for _ in range(5):  # on a busy machine the one who is there may answer too late
            with pytest.raises(FingerError) as error:
                finger_on(wire, **options).connect()
            if re.search(sentence, str(error.value)):
                break
        assert re.search(sentence, str(error.value))
        kept = [name for name in before if servo.model[name].writable]
        assert all(servo.memory[name] == before[name] for name in kept)
        assert str(error.value).endswith(".")

    def test_wrong_id(self, wire):
        self.refused(
            wire, r"servo 4 does not answer at 1000000 baud, but servo 1", id=4
        )

    def test_wrong_rate(self, wire):
        self.refused(wire, r"at 57600 baud, but at 1000000\.", baud=57600)

    def test_no_such_rate(self, wire):
        self.refused(wire, r"no serial port supports 12345 baud", baud=12345)

    def test_wrong_model(self, wire):
        sentence = r"servo 1 has model number 1060, but the mx28 has 30"
        self.refused(wire, sentence, model="mx28")

    def test_busy(self, servo, wire):
        with finger_on(wire, safety=Safety(command_timeout=60.0)) as finger:
            again = [sys.executable, "-c", SECOND, wire.port]
            done = subprocess.run(again, capture_output=True, text=True, timeout=60)
            sentence = f"another program uses this port (process {os.getpid()}), close"
            assert sentence in done.stderr.splitlines()[-1]
            # It did not change the rate before it noticed.
            stream(finger, 0.8, 0.4)
            assert (finger.state().mode, finger.state().alert) == ("active", "")
        assert not servo.torque

    def test_absent(self):
        with pytest.raises(FingerError, match=r"no such port, see ls /dev/serial"):
            open_finger("dynamixel:/dev/ttyNOWHERE").connect()
        with pytest.raises(FingerError, match=r"this is not a serial port"):
            open_finger("dynamixel:/dev/null").connect()

    def test_complaining(self, servo, wire):
        servo.overheat()
        self.refused(wire, r"reports overheating; let it rest, then power-cycle")


SECOND = """
import sys
from ikns.finger import DynamixelFinger
DynamixelFinger(sys.argv[1], baud=57_600).connect()
"""
LEAVES = """
import os, signal, sys, time
from ikns.finger import DynamixelFinger
finger = DynamixelFinger(sys.argv[1], baud=1_000_000)
def drive():
    print("ready", flush=True)
    while True:
        finger.command(0.5 + 0.4 * (time.monotonic() % 1))
        time.sleep(0.005)
"""
#: What the command line does: it handles signals, and connects in a thread.
THREAD = """
import threading
from ikns.endings import handle_endings, signal_exit_code, stop_on_signals
def live():
    with finger:
        drive()
with handle_endings(last=True), stop_on_signals() as stop:
    threading.Thread(target=live, daemon=True).start()
    while not stop.is_set():
        time.sleep(0.01)
    time.sleep(0.5)  # the torque does not wait for this
    assert finger.state().mode == "relaxed", finger.state()
    code = signal_exit_code()
sys.exit(code)
"""
ENDINGS = {
    "thread": THREAD,
    "with": "with finger:\n    drive()",
    "bare": "finger.connect()\ndrive()",
    "exception": "finger.connect()\nprint('ready', flush=True)\nraise SystemError",
}


def start(program, wire):
    """Run a program until it says that it is ready."""
    command = [sys.executable, "-c", program, wire.port]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdout=pipe, stderr=pipe)
    if process.stdout.readline() != b"ready\n":
        pytest.fail(process.communicate(timeout=TIMEOUT)[1].decode())
    return process


@pytest.mark.parametrize(
    ("ending", "number"),
    [
        ("with", signal.SIGINT),
        ("bare", signal.SIGINT),
        ("with", signal.SIGTERM),
        ("bare", signal.SIGHUP),
        ("with", signal.SIGQUIT),
        ("thread", signal.SIGINT),
        ("thread", signal.SIGTERM),
        ("thread", signal.SIGHUP),
        ("thread", signal.SIGQUIT),
        ("exception", None),
    ],
)
def test_no_exit_leaves_torque_on(servo, wire, ending, number):
    program = LEAVES + ENDINGS[ending]
    process = start(program, wire)
    if number is not None:
        assert servo.torque
        os.kill(process.pid, number)
    process.communicate(timeout=TIMEOUT)
    assert not servo.torque
    assert "torque on" in [text for _, text in servo.events]
    code = 1 if number is None else 128 + number
    if number == signal.SIGINT and ending != "thread":
        code = -number  # as Python ends itself
    assert process.returncode == code


def test_impatience_does_not_leave_torque_on(servo, wire):
    process = start(LEAVES + ENDINGS["with"], wire)
    wire.inject("mute", duration=0.3)  # relaxing takes a while
    for _ in range(3):
        os.kill(process.pid, signal.SIGINT)
        time.sleep(0.05)
    process.communicate(timeout=TIMEOUT)
    assert not servo.torque
    assert not servo.watchdog_error


def test_after_a_kill_the_servos_own_watchdog_stops_it(servo, wire):
    process = start(LEAVES + ENDINGS["with"], wire)
    process.kill()
    process.communicate(timeout=TIMEOUT)
    took = wait_for(lambda: servo.watchdog_error)
    assert took < 2.0  # 0.3 s, on a busy machine
    wait_for(lambda: servo.motor.velocity == 0)


UNPLUGGED = """
import os, sys
from ikns.finger import DynamixelFinger, FingerError
finger = DynamixelFinger(sys.argv[1], baud=1_000_000)
finger.connect()
os.unlink(sys.argv[1])
finger.make_safe("a test")
finger._bus.close()
if sys.argv[2] != "never":
    try:
        finger.relax()
    except FingerError as error:
        sys.stderr.write(f"first: {error}\\n")
if sys.argv[2] == "connected again":
    try:
        finger.connect()
    except FingerError:
        pass
"""


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("asked", ["first: "]),
        ("never", ["ikns: "]),
        ("connected again", ["first: ", "ikns: "]),
    ],
)
def test_torque_that_stays_on_is_told_once_a_connection(wire, asked, told):
    done = subprocess.run(
        [sys.executable, "-c", UNPLUGGED, str(wire.port), asked],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    for line, start in zip(done.stderr.splitlines(), told, strict=True):
        assert line.startswith(start)
        assert "did not confirm that its torque is off" in line


def test_no_thread_outlives_a_finger(wire):
    before = set(threading.enumerate())
    for _ in range(3):
        with finger_on(wire) as finger:
            finger.command(0.5)
    assert set(threading.enumerate()) == before
