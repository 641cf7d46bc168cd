"""Several fingers: each follows its freedom, and what stops one stops all."""

import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.finger import (
    FingerError,
    FingerGroup,
    Safety,
    SimulatedFinger,
    open_fingers,
)

#: Longer than anything here takes, even on a busy machine, s.
PATIENCE = 20.0


ROS = "ros2:/goals?type=joint_trajectory&open=0&closed=1&safe=hold"
NUMBER = ROS.replace("joint_trajectory", "position")


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
        (["sim:dof=0"], "expected 1 or more"),
        (["sim:dof=-1"], "expected 1 or more"),
        (["sim:dof=two"], "expected a number"),
        (["sim:dof=1&dof=2"], "gives dof twice"),
        (["sim:dof=3"], "the map has 2 degrees of freedom"),
        (["sim:", "sim:dof=1"], "both ask for dof=1"),
        (["dynamixel:/dev/z", "dynamixel:/dev/z?dof=2"], "are the same servo"),
        (
            ["dynamixel:/dev/z", "dynamixel:/dev/z?dof=2&id=2&model=ax12"],
            "one baud rate and protocol",
        ),
        ([f"{ROS}&joint=a", f"{ROS}&joint=a&dof=2"], "are the same joint"),
        # One number a message: a joint's name does not make two of a topic.
        ([f"{NUMBER}&joint=a", f"{NUMBER}&joint=b&dof=2"], "are the same joint"),
        (["sim:safe=x"], r"'sim:safe=x'.*safe"),
    ],
)
def test_what_is_wrong_with_an_address_is_said(texts, words):
    with pytest.raises(InvalidInput, match=words):
        open_fingers(texts, n_dof=2)


def test_two_joints_of_a_trajectory_topic_are_two_fingers():
    texts = [f"{ROS}&joint=a", f"{ROS}&joint=b&dof=2"]
    assert open_fingers(texts, n_dof=2).dofs == (1, 2)
    assert open_fingers([ROS + "&joint=a", ROS + "&joint=a&dof=2&domain=3"])


def test_a_link_to_a_port_is_that_port(tmp_path):
    (tmp_path / "servo").symlink_to("/dev/null")
    texts = ["dynamixel:/dev/null", f"dynamixel:{tmp_path / 'servo'}?dof=2"]
    with pytest.raises(InvalidInput, match="are the same servo"):
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
