"""A finger that is a joint under ROS 2; the robot is a foreign node of the tests."""

import math
import time

import numpy as np
import pytest
from command_line import check_refused
from ros_graph import Graph, Peer, Robot

from ikns.errors import InvalidInput
from ikns.finger import FingerError, Safety, check_finger, open_finger
from ikns.finger.laws import LAWS

OPEN, CLOSED = 0.2, 1.4
#: A cycle of the finger's thread is 20 ms; the rest is for a machine that is busy.
BUSY = 5.0


@pytest.fixture
def graph():
    with Graph() as made:
        yield made


@pytest.fixture
def robot(graph):
    made = Robot(graph.port, position=0.5)
    yield made
    made.close()


def address(graph, more="&feedback=joint_states", *, command="joint_trajectory"):
    return (
        f"ros2:finger/commands?type={command}&joint=finger&open={OPEN}&closed={CLOSED}"
        f"&router=127.0.0.1:{graph.port}&domain=0&safe=hold{more}"
    )


def opened(graph, more="&feedback=joint_states", *, silence=5.0, **about):
    """A finger that forgives a busy machine: commands may pause, and feedback too."""
    safety = Safety(silence_timeout=silence, command_timeout=10.0)
    return open_finger(address(graph, more, **about), safety=safety)


def drive(finger, flexion, duration):
    end = time.monotonic() + duration
    while time.monotonic() < end:
        finger.command(flexion)
        time.sleep(0.01)


def until(holds):
    give_up = time.monotonic() + 10
    while not holds() and time.monotonic() < give_up:
        time.sleep(0.002)
    assert holds()


def test_it_keeps_the_laws_of_every_finger(graph, robot):
    report = check_finger(
        lambda: open_finger(address(graph), safety=Safety(silence_timeout=5.0))
    )
    assert set(report.kept) == set(LAWS)
    # What the robot got kept the range too; a ten-billionth is for the arithmetic.
    _, goals = np.array(robot.goals).T
    assert OPEN - 1e-10 <= goals.min()
    assert goals.max() <= CLOSED + 1e-10


def test_without_feedback_nothing_is_called_measured(graph, robot):
    finger = opened(graph, "")
    with finger:
        drive(finger, 1.0, 0.1)
        assert math.isnan(finger.state().flexion)
        assert finger.state().mode == "active"
    # It starts from open, as it cannot know better.
    assert robot.goals[0][1] <= OPEN + 0.1 * (CLOSED - OPEN)


def test_positions_are_one_number(graph):
    robot = Robot(graph.port, command="position", position=0.5)
    with opened(graph, command="position") as finger:
        drive(finger, 1.0, 0.3)
    robot.close()
    assert finger.state().mode == "relaxed"
    goals = [goal for _, goal in robot.goals]
    # From where it was, 0.25 of the way, within one step of the limiter's first 20 ms.
    assert goals[0] == pytest.approx(0.5, abs=0.02)
    assert max(goals) > 0.6


def test_the_end_leaves_it_where_it_is(graph, robot):
    with opened(graph) as finger:
        drive(finger, 1.0, 0.2)
        until(lambda: robot.position > 0.55)
    # What was sent has arrived, and nothing more is sent.
    until(lambda: time.monotonic() - robot.goals[-1][0] > 0.5)
    until(lambda: abs(robot.position - robot.goals[-1][1]) < 0.05)


@pytest.mark.parametrize(
    ("fault", "within", "says"),
    [
        ("kill", 0.02, "the router at 127.0.0.1:{} went away"),
        ("pause", 1.0 + 0.05 + 0.02, "no answer from the router at 127.0.0.1:{}"),
        ("quiet", 1.0 + 0.02, "no feedback of joint 'finger' for 1 s"),
        ("controller", 0.02, "no one listens to /finger/commands any more"),
    ],
)
def test_a_fault_makes_it_safe_in_the_stated_time(
    graph, robot, fault, within, says, monkeypatch
):
    monkeypatch.setattr("ikns.finger.ros_joint._WAIT", 0.3)
    with opened(graph, silence=1.0) as finger:
        drive(finger, 0.6, 0.1)
        began = time.monotonic()
        if fault in ("kill", "pause"):
            getattr(graph, fault)()
        elif fault == "quiet":
            robot.quiet.set()
        else:
            robot.controller.undeclare()
        while finger.state().mode == "active" and time.monotonic() < began + 10:
            finger.command(0.6)
            time.sleep(0.002)
        took = time.monotonic() - began
        state = finger.state()
        assert state.mode == "safe"
        # A router that hangs keeps the feedback back too, and one that went away takes
        # the controller with it: either may be noticed first.
        others = {"pause": "no feedback of joint", "kill": "no one listens to"}
        expected = says.format(graph.port), others.get(fault, says)
        assert state.alert.startswith(expected)
        assert took < within + BUSY
        with pytest.raises(FingerError):  # it cannot be armed as long as that lasts
            finger.connect()
        if fault == "pause":
            graph.go_on()


def test_in_its_safe_state_it_opens_if_asked_to(graph, robot):
    where = address(graph).replace("safe=hold", "safe=open")
    safety = Safety(silence_timeout=5.0, command_timeout=10.0)
    with open_finger(where, safety=safety) as finger:
        drive(finger, 0.6, 0.2)
        finger.make_safe("a test")
        until(lambda: robot.position < OPEN + 0.01)
        assert finger.state().alert == "a test"


def test_a_loop_that_hangs_leaves_it_safe(graph, robot):
    safety = Safety(silence_timeout=5.0)
    with open_finger(address(graph), safety=safety) as finger:
        drive(finger, 1.0, 0.1)
        until(lambda: finger.state().mode == "safe")
        assert finger.state().alert == "no command for 0.5 s"
        held = finger.state().sent
        count = len(robot.goals)
        until(lambda: len(robot.goals) > count + 3)
        # It goes on telling the robot to stay.
        assert robot.goals[-1][1] == pytest.approx(OPEN + held * (CLOSED - OPEN))


def test_what_is_missing_is_said(graph, monkeypatch):
    monkeypatch.setattr("ikns.finger.ros_joint._WAIT", 0.5)

    def refused(more="&feedback=joint_states", **about):
        with pytest.raises(FingerError) as refusal:
            open_finger(address(graph, more, **about)).connect()
        return str(refusal.value)

    assert "expected a controller that listens to trajectory_msgs" in refused()
    robot = Robot(graph.port, position=0.5, joints=["wrist"])
    assert "in sensor_msgs/msg/JointState on /joint_states" in refused()
    assert "found only wrist." in refused()
    assert "found no message." in refused("&feedback=/nothing")
    said = refused(command="position")
    assert "Float64MultiArray, found one for trajectory_msgs/msg/JointTraj" in said
    robot.close()
    robot = Robot(graph.port, position=3.0)
    assert "between open and closed, found it at 3;" in refused()
    robot.close()
    peer = Peer(graph.port)
    graph.kill()
    assert "expected a zenoh router" in refused()
    peer.close()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ros2:", "lacks type and open and closed"),
        ("ros2:f?type=x&open=0&closed=1&safe=hold", "type=joint_trajectory or type="),
        (
            "ros2:f?type=position&open=0&closed=0&safe=hold",
            "two positions of the joint",
        ),
        ("ros2:f?type=position&open=0&closed=nan&safe=hold", "two positions"),
        ("ros2:f?type=joint_trajectory&open=0&closed=1&safe=hold", "name of the joint"),
        ("ros2:f?type=position&open=0&closed=1&rate=0&safe=hold", "0 to 1000 Hz"),
        ("ros2:f?type=position&open=0&closed=1", "safe state limp cannot be kept"),
        ("ros2:9?type=position&open=0&closed=1&safe=hold", "letters, digits"),
        ("ros2:f?type=position&open=0&closed=1&safe=hold&router=x", "router=HOST"),
        ("ros2:f?type=position&open=a&closed=1", "open=a, expected a number"),
    ],
)
def test_a_wrong_address_is_refused(text, words):
    with pytest.raises(InvalidInput, match=words):
        open_finger(text)


def test_the_command_line_says_that_limp_is_impossible(files, capfd):
    argv = [
        *("run", "--subject", str(files / "person")),
        *("--source", f"replay:{files / 'free.c3d'}?speed=max"),
        *("--finger", "ros2:/f?type=position&open=0&closed=1"),
    ]
    assert "--safe-state hold" in check_refused(argv, files, capfd)
