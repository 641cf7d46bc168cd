"""A program that is stopped for a while, and a servo in a process that is not.

The servo shares no line with the package, and what is judged is its own register.
"""

import os
import signal
import subprocess
import sys
import time

import pytest
from independent_servo.process import ServoProcess

#: Drives a finger until it is interrupted.
DRIVES = """
import sys, time
from ikns.finger import DynamixelFinger, Safety
safety = Safety(safe_state=sys.argv[3])
with DynamixelFinger(sys.argv[1], model=sys.argv[2], safety=safety) as finger:
    print("ready", flush=True)
    while True:
        finger.command(0.5 + 0.4 * (time.monotonic() % 1))
        time.sleep(0.005)
"""
LINES = [*((delay, False) for delay in (0.0, 0.002, 0.004, 0.01)), (0.0, True)]
#: Seconds after which the servo's watchdog stops it, and the finger's own time-out.
WATCHDOG, TIMEOUT = 0.3, 0.5
#: What a busy machine may add, s.
BUSY = 1.5


def wait_for(condition, timeout):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


class Driven:
    """A program that drives a finger on a servo of its own."""

    def __init__(self, servo, model, safe_state):
        self.servo = servo
        argv = [sys.executable, "-c", DRIVES, str(servo.port), model, safe_state]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(argv, stdout=pipe, stderr=pipe)
        assert self.process.stdout.readline() == b"ready\n"
        wait_for(lambda: len(servo.events("goal")) > 5, 10)

    def stop(self, seconds):
        """Stop it for a while; return what the servo's watchdog did meanwhile."""
        os.kill(self.process.pid, signal.SIGSTOP)
        time.sleep(seconds)
        done = [event["tripped"] for event in self.servo.events("watchdog")]
        os.kill(self.process.pid, signal.SIGCONT)
        return done

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=30)
        assert not self.servo["torque_enable"]


@pytest.mark.parametrize(("delay", "byte_time"), LINES)
@pytest.mark.parametrize("model", ["xl430", "ax12"])
def test_limp_means_that_the_register_of_the_torque_is_zero(
    tmp_path, model, delay, byte_time
):
    with ServoProcess(
        tmp_path, model=model, answer_delay=delay, byte_time=byte_time
    ) as servo:
        driven = Driven(servo, model, "limp")
        assert driven.stop(0.6) == ([1] if model == "xl430" else [])
        wait_for(lambda: not servo["torque_enable"], TIMEOUT + BUSY)
        # It stays so: a finger does not take itself up again.
        time.sleep(0.3)
        assert not servo["torque_enable"]
        assert not any(e["torque"] for e in servo.events("eeprom"))
        driven.end()


@pytest.mark.parametrize("clears_profile", [False, True])
@pytest.mark.parametrize("safe_state", ["hold", "open"])
def test_after_its_watchdog_it_holds_or_opens_from_where_it_is(
    tmp_path, safe_state, clears_profile
):
    with ServoProcess(
        tmp_path, answer_delay=0.004, clears_profile=clears_profile
    ) as servo:
        driven = Driven(servo, "xl430", safe_state)
        driven.stop(0.6)
        stood = servo["present_position"]
        wait_for(lambda: servo["bus_watchdog"] > 0, TIMEOUT + BUSY)
        assert servo["torque_enable"]
        assert servo["profile_velocity"] > 0
        # The first goal after the watchdog is where it stands, to a tick.
        tripped = servo.events("watchdog")[0]["t"]
        accepted = [e for e in servo.events("goal") if not e["error"]]
        after = [e["goal"] for e in accepted if e["t"] > tripped]
        assert abs(after[0] - stood) <= 1
        if safe_state == "open":
            wait_for(lambda: servo["present_position"] < 1024 + 5, 5)
        else:
            time.sleep(0.3)
            assert abs(servo["present_position"] - stood) <= 5
        driven.end()
