"""Several fingers: each follows its freedom, and what stops one stops all."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from independent_servo.process import ServoProcess

from ikns.errors import InvalidInput
from ikns.finger import (
    FingerError,
    FingerGroup,
    Safety,
    SimulatedFinger,
    open_fingers,
)
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


# --- addresses -----------------------------------------------------------------------


@st.composite
def addresses(draw):
    """Addresses with what they mean, as words and not by the code under test."""
    found = []
    for _ in range(draw(st.integers(1, 4))):
        dof = draw(st.sampled_from([None, 1, 2, 3]))
        options = [] if dof is None else [f"dof={dof}"]
        if draw(st.booleans()):
            place = draw(st.sampled_from(["/dev/null", "/dev/../dev/null", "/dev/z"]))
            servo, baud = draw(st.integers(1, 2)), draw(st.sampled_from([9600, 57600]))
            options += [f"id={servo}", f"baud={baud}"]
            where = ("/dev/z" if place == "/dev/z" else "/dev/null", servo, baud)
        else:
            place, where = "", None
            options += draw(st.sampled_from([[], ["effort=0.3"], ["safe=hold"]]))
        scheme = "dynamixel" if place else "sim"
        query = "&".join(draw(st.permutations(options)))
        mark = "?" if query and (place or draw(st.booleans())) else ""
        found.append((f"{scheme}:{place}{mark}{query}", dof or 1, where))
    return found


@given(known=addresses(), n_dof=st.integers(1, 3))
def test_addresses_are_taken_or_refused_in_a_sentence(known, n_dof):
    texts, dofs, places = zip(*known, strict=True)
    servos = [place for place in places if place]
    right = (
        len(set(dofs)) == len(dofs)
        and max(dofs) <= n_dof
        and len({(port, number) for port, number, _ in servos}) == len(servos)
        and len({(port, baud) for port, _, baud in servos})
        == len({port for port, *_ in servos})
    )
    if right:
        group = open_fingers(texts, n_dof=n_dof)
        assert (group.dofs, len(group.fingers)) == (dofs, len(dofs))
        return
    with pytest.raises(InvalidInput) as error:
        open_fingers(texts, n_dof=n_dof)
    told = str(error.value)
    assert told.endswith(".")
    assert "\n" not in told
    assert any(f"'{text}'" in told for text in texts)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["sim:dof=0"], "from 1 on"),
        (["sim:dof=-1"], "from 1 on"),
        (["sim:dof=two"], "expected a number"),
        (["sim:dof=1&dof=2"], "gives dof twice"),
        (["sim:dof=3"], "the map has 2 freedoms"),
        (["sim:", "sim:dof=1"], "both want dof=1"),
        (["dynamixel:/dev/z", "dynamixel:/dev/z?dof=2"], "are one servo"),
        (
            ["dynamixel:/dev/z", "dynamixel:/dev/z?dof=2&id=2&model=ax12"],
            "one baud rate and protocol",
        ),
    ],
)
def test_what_is_wrong_with_an_address_is_said(texts, words):
    with pytest.raises(InvalidInput, match=words):
        open_fingers(texts, n_dof=2)


def test_a_link_to_a_port_is_that_port(tmp_path):
    (tmp_path / "servo").symlink_to("/dev/null")
    texts = ["dynamixel:/dev/null", f"dynamixel:{tmp_path / 'servo'}?dof=2"]
    with pytest.raises(InvalidInput, match="are one servo"):
        open_fingers(texts, n_dof=2)


@pytest.mark.parametrize("dofs", [[], [1], [1, 1], [0, 1]])
def test_a_group_needs_a_freedom_for_each_finger(dofs):
    with pytest.raises(InvalidInput, match="expected"):
        FingerGroup([SimulatedFinger(), SimulatedFinger()], dofs)


# --- safe is safe for all, with simulated fingers ------------------------------------


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.mark.parametrize("safe_state", ["limp", "hold", "open"])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_finger_in_its_safe_state_brings_all_into_theirs(which, safe_state):
    clock = Clock()
    safety = Safety(safe_state=safe_state)
    fingers = [SimulatedFinger(clock=clock, safety=safety) for _ in range(3)]
    with FingerGroup(fingers, (3, 1, 2)) as group:
        for _ in range(20):
            clock.now += 0.01
            group.command([1.0, 0.5, 0.0])
        assert {state.mode for state in group.states()} == {"active"}
        fingers[which].make_safe("the tendon is slack")
        group.command([1.0, 0.5, 0.0])  # the one call that a loop makes
        assert [finger.state().mode for finger in fingers] == ["safe"] * 3
        number = (3, 1, 2)[which]
        assert group.state().mode == "safe"
        assert group.state().alert == f"finger {number}: the tendon is slack"
        others = [f.state().alert for f in fingers if f is not fingers[which]]
        assert set(others) == {f"finger {number} stopped: the tendon is slack"}
    assert [finger.state().mode for finger in fingers] == ["relaxed"] * 3


@pytest.mark.parametrize("ending", [False, True])
def test_a_finger_that_gave_up_stops_the_others_unless_all_do(ending, monkeypatch):
    monkeypatch.setattr("ikns.finger.group.ending_requested", lambda: ending)
    fingers = [SimulatedFinger(), SimulatedFinger()]
    with FingerGroup(fingers) as group:
        fingers[0].relax()
        group.command([0.5, 0.5])
        # A signal relaxes each by itself, a moment apart: nothing has failed then.
        assert fingers[1].state().mode == ("active" if ending else "safe")


def test_each_finger_has_its_own_limits_and_its_own_obstacle():
    clock = Clock()
    free, blocked = (
        SimulatedFinger(clock=clock, object_width=width) for width in (None, 0.06)
    )
    with FingerGroup([free, blocked]) as group:
        for _ in range(300):
            clock.now += 0.01
            group.command([1.0, 1.0])
        states = group.states()
    assert [state.stalled for state in states] == [False, True]
    assert states[0].flexion > states[1].flexion + 0.1
    assert [state.mode for state in states] == ["active", "active"]


class Refusing(SimulatedFinger):
    """A finger that takes its time to connect, and then may not."""

    def __init__(self, *, wait, refuses):
        super().__init__(safety=Safety(command_timeout=0.1))
        self._wait, self._refuses = wait, refuses

    def connect(self):
        time.sleep(self._wait)
        if self._refuses:
            raise FingerError("nobody is there.")
        super().connect()


def test_a_finger_that_cannot_be_connected_leaves_none_connected():
    first = SimulatedFinger()
    group = FingerGroup([first, Refusing(wait=0.0, refuses=True)])
    with pytest.raises(FingerError, match="nobody is there"), group:
        pass
    assert first.state().mode == "relaxed"
    with pytest.raises(FingerError, match="nobody is there"):
        group.connect()
    assert first.state().mode == "safe"
    group.relax()


def test_a_finger_that_is_connected_holds_while_others_connect():
    # Its time-out for commands is a third of the wait.
    fingers = [Refusing(wait=0.0, refuses=False), Refusing(wait=0.3, refuses=False)]
    with FingerGroup(fingers) as group:
        assert {state.mode for state in group.states()} == {"active"}


class Stuck(SimulatedFinger):
    """A finger whose relaxing waits for another's, and then fails."""

    def __init__(self, barrier):
        super().__init__()
        self._barrier = barrier

    def relax(self):
        self._barrier.wait(PATIENCE)  # broken unless all are relaxed at a time
        super().relax()
        raise FingerError("cut its power.")


def test_all_are_relaxed_at_the_same_time_and_all_failures_are_said():
    barrier = threading.Barrier(2)
    fingers = [Stuck(barrier), Stuck(barrier)]
    with pytest.raises(FingerError, match="cut its power") as error:
        with FingerGroup(fingers):
            pass
    assert error.value.__notes__ == ["cut its power."]
    assert [finger.state().mode for finger in fingers] == ["relaxed"] * 2


# --- two servos ----------------------------------------------------------------------


@contextlib.contextmanager
def servos_at(layout, folder, **options):
    """Two servos, and their addresses with the freedoms 1 and 2."""
    with contextlib.ExitStack() as stack:
        servos, texts = [], []
        for ids in PORTS[layout]:
            place = folder / f"port{len(texts)}"
            place.mkdir()
            one = ServoProcess(place, id=ids, baud=BAUD, **options)
            stack.enter_context(one)
            for number in ids:
                servos.append(one.servo(number))
                dof = len(servos)
                texts.append(f"dynamixel:{one.port}?id={number}&baud={BAUD}&dof={dof}")
        yield servos, texts


def drive(group, condition, flexions=(0.8, 0.2)):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        group.command(flexions)
        time.sleep(0.01)


@pytest.mark.parametrize("layout", PORTS)
def test_each_servo_gets_its_own_goals(layout, tmp_path):
    with servos_at(layout, tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2) as group:
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


FAULTS = [
    ({"do": "alert", "name": "overload"}, "the servo reports overload"),
    ({"do": "power"}, "the servo has lost its torque|no answer"),
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
        with open_fingers(texts, n_dof=2) as group:
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
    with servos_at("two ports", tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2) as group:
            drive(group, lambda: all(len(s.events("goal")) > 5 for s in servos))
            servos[1].request(do="silence", on=True)
            drive(group, lambda: not servos[0]["torque_enable"])
            until(lambda: servos[1]["bus_watchdog"] == -1)
            servos[1].request(do="silence", on=False)
            until(lambda: not servos[1]["torque_enable"])  # as soon as it can be told


def test_a_servo_without_answers_does_not_keep_the_other_waiting(tmp_path):
    safety = Safety(silence_timeout=PATIENCE)  # so that nothing stops
    with servos_at("one port", tmp_path) as (servos, texts):
        with open_fingers(texts, n_dof=2, safety=safety) as group:
            servos[0].request(do="mute", on=True)
            drive(group, lambda: servos[1]["goal_position"] == 1434)
            servos[0].request(do="mute", on=False)


def test_a_thread_that_hangs_silences_the_port_so_that_both_watchdogs_stop(
    tmp_path, monkeypatch
):
    hang = threading.Event()
    monkeypatch.setattr("ikns.finger.group.FingerGroup.states", lambda self: [])
    with servos_at("one port", tmp_path) as (servos, texts):
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
            with pytest.raises(FingerError, match="another finger has servo 1"):
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
    with servos_at(layout, tmp_path) as (servos, texts):
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
