"""Two servos, on one port and on two: what stops one stops both, asked of registers."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from independent_servo.process import ServoProcess

from ikns.finger import FingerError, Safety, open_fingers
from ikns.finger.line import join_line

#: Longer than anything here takes, even on a busy machine, s.
PATIENCE = 20.0
BAUD = 1_000_000
PORTS = {"one port": ((1, 2),), "two ports": ((1,), (1,))}


def until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.005)


@contextlib.contextmanager
def servos_at(layout, folder, *, watchdog=2.5):
    """Two servos, and their addresses with the freedoms 1 and 2.

    A busy machine must not trip a watchdog that is not what is tested.
    """
    with contextlib.ExitStack() as stack:
        servos, texts = [], []
        for ids in PORTS[layout]:
            place = folder / f"port{len(texts)}"
            place.mkdir()
            one = ServoProcess(place, id=ids, baud=BAUD)
            stack.enter_context(one)
            for number in ids:
                servos.append(one.servo(number))
                dof = len(servos)
                options = f"id={number}&baud={BAUD}&dof={dof}&watchdog={watchdog}"
                texts.append(f"dynamixel:{one.port}?{options}")
        yield servos, texts


#: Nor must it seem to have stopped commanding.
BUSY = Safety(command_timeout=PATIENCE)


def drive(group, condition, flexions=(0.8, 0.2)):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        group.command(flexions)
        time.sleep(0.01)


@pytest.mark.parametrize("layout", PORTS)
def test_each_servo_gets_its_own_goals(layout, tmp_path):
    with servos_at(layout, tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2, safety=BUSY) as group:
            # Ticks of flexions 0.8 and 0.2: a quarter turn to either side of 2048.
            ends = [round(1024 + 2048 * flexion) for flexion in (0.8, 0.2)]
            drive(group, lambda: [s["goal_position"] for s in servos] == ends)
            until(
                lambda: all(
                    abs(s["present_position"] - end) < 4
                    for s, end in zip(servos, ends, strict=True)
                )
            )
            assert [servo["torque_enable"] for servo in servos] == [1, 1]
        assert [servo["torque_enable"] for servo in servos] == [0, 0]
        for servo, end in zip(servos, ends, strict=True):
            goals = {event["goal"] for event in servo.events("goal")}
            between = range(min(2048, end), max(2048, end) + 1)
            assert goals <= set(between)  # never the other's


#: What is noticed first depends on the moment: the torque that is gone, or why.
LOST = "the servo has lost its torque"
FAULTS = [
    ({"do": "alert", "name": "overload"}, f"the servo reports overload|{LOST}"),
    ({"do": "power"}, f"{LOST}|no answer"),
    ({"do": "mute", "on": True}, "no answer from the servo"),
]


@pytest.mark.parametrize(
    ("layout", "fault", "which"),
    [
        ("one port", 0, 0),
        ("one port", 1, 1),
        ("one port", 2, 0),
        ("two ports", 0, 1),
        ("two ports", 2, 1),
    ],
)
def test_one_servo_that_fails_takes_the_torque_of_both(layout, fault, which, tmp_path):
    asked, reason = FAULTS[fault]
    with servos_at(layout, tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2, safety=BUSY) as group:
            drive(group, lambda: all(len(s.events("goal")) > 5 for s in servos))
            servos[which].request(**asked)
            # Asked of the servos' registers, while they are still commanded.
            drive(group, lambda: not any(s["torque_enable"] for s in servos))
            assert [state.mode for state in group.states()] == ["safe", "safe"]
            alert = group.state().alert
            assert re.search(f"finger {which + 1}: .*({reason})", alert)
            servos[which].request(**asked | {"on": False})


def test_a_servo_that_hears_nothing_is_stopped_by_its_watchdog_and_the_other_too(
    tmp_path,
):
    with servos_at("two ports", tmp_path, watchdog=0.3) as (servos, texts):
        with open_fingers(texts, n_dof=2, safety=BUSY) as group:
            drive(group, lambda: all(len(s.events("goal")) > 5 for s in servos))
            servos[1].request(do="silence", on=True)
            drive(group, lambda: not servos[0]["torque_enable"])
            until(lambda: servos[1]["bus_watchdog"] == -1)
            servos[1].request(do="silence", on=False)
            until(lambda: not servos[1]["torque_enable"])  # as soon as it can be told


def test_a_servo_without_answers_does_not_keep_the_other_waiting(tmp_path):
    safety = replace(BUSY, silence_timeout=PATIENCE)  # so that nothing stops
    with servos_at("one port", tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2, safety=safety) as group:
            servos[0].request(do="mute", on=True)
            drive(group, lambda: servos[1]["goal_position"] == 1434)
            servos[0].request(do="mute", on=False)


def test_a_port_that_was_unplugged_serves_both_servos_again(tmp_path):
    with servos_at("one port", tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2) as group:
            drive(group, lambda: all(len(s.events("goal")) > 5 for s in servos))
            servos[0].request(do="unplug")
            drive(group, lambda: [s.mode for s in group.states()] == ["safe"] * 2)
            servos[0].request(do="replug")
            until(lambda: not any(servo["torque_enable"] for servo in servos))
            group.connect()
            assert [servo["torque_enable"] for servo in servos] == [1, 1]
            drive(group, lambda: [s["goal_position"] for s in servos] == [2662, 1434])
        assert [servo["torque_enable"] for servo in servos] == [0, 0]


def test_a_thread_that_hangs_silences_the_port_so_that_both_watchdogs_stop(
    tmp_path, monkeypatch
):
    hang = threading.Event()
    monkeypatch.setattr("ikns.finger.group.FingerGroup.states", lambda self: [])
    with servos_at("one port", tmp_path, watchdog=0.3) as (servos, texts):
        with open_fingers(texts, n_dof=2) as group:
            drive(group, lambda: all(len(s.events("goal")) > 5 for s in servos))
            inner = group.fingers[1]._drive
            monkeypatch.setattr(inner, "cycle", lambda: hang.wait(PATIENCE))
            drive(group, lambda: all(s["bus_watchdog"] == -1 for s in servos))
            hang.set()


def test_a_servo_is_had_by_one_finger_and_a_port_has_one_rate(tmp_path):
    with servos_at("one port", tmp_path) as (_, texts):
        with open_fingers(texts[:1]):
            port = texts[0].partition(":")[2].partition("?")[0]
            with pytest.raises(
                FingerError, match="another finger already uses servo 1"
            ):
                join_line(port, 1, baud=BAUD, protocol=2)
            with pytest.raises(FingerError, match="expected one baud rate"):
                join_line(port, 2, baud=57600, protocol=2)


PROGRAM = """
import sys, time
from ikns.finger import open_fingers
with open_fingers(sys.argv[1:]) as group:
    for k in range(10**6):
        group.command([k % 100 / 100, 1 - k % 100 / 100])
        if k == 20:
            print("ready", flush=True)
        time.sleep(0.01)
"""


@pytest.mark.parametrize(
    ("layout", "number"),
    [
        ("one port", signal.SIGHUP),
        ("one port", signal.SIGTERM),
        ("two ports", signal.SIGINT),
        ("one port", signal.SIGKILL),
        ("two ports", signal.SIGKILL),
    ],
)
def test_no_ending_leaves_one_of_two_servos_moving(layout, number, tmp_path):
    with servos_at(layout, tmp_path, watchdog=0.3) as (servos, texts):
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *texts],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
        )
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        os.kill(process.pid, number)
        said = process.communicate(timeout=PATIENCE)[1].decode()
        if number == signal.SIGKILL:
            # Nothing is left to tell them; each has its own watchdog.
            until(lambda: all(servo["bus_watchdog"] == -1 for servo in servos))
        else:
            assert [servo["torque_enable"] for servo in servos] == [0, 0], said
