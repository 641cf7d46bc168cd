"""What of the part for lerobot needs no lerobot: the finger's own side, the signal.

That it works with lerobot is not shown here, where lerobot is not installed: that is
what `benchmarks/outside/lerobot_robot.py` is for.
"""

import gc
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.errors import IknsError, InvalidInput, StreamError
from ikns.finger import (
    FingerError,
    LeRobotFinger,
    RelayFinger,
    Safety,
    check_finger,
    open_finger,
    open_fingers,
)
from ikns.finger.relax_at_exit import forget
from ikns.live.lerobot.action import action, action_names, check_joints
from ikns.live.lerobot.signal import LiveSignal
from ikns.live.runtime.priority import realtime_priority
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording

JOINT = {"joint": "gripper.pos", "open": 100.0, "closed": 0.0}


class Bus:
    """Torque as a motor bus of lerobot has it."""

    def __init__(self, robot):
        self.motors, self.robot, self.obeys = {"gripper": None}, robot, True
        self.alone = False  # connected without its robot

    @property
    def is_connected(self):
        return self.alone or self.robot.is_connected

    def connect(self):
        self.robot._wire()
        self.alone = True

    def disconnect(self):
        self.alone = False

    def disable_torque(self, motor):
        assert self.is_connected
        self.robot._wire()
        self.robot.torque = self.robot.torque and not self.obeys

    def read(self, name, motor, *, normalize):
        assert (name, motor, normalize) == ("Torque_Enable", "gripper", False)
        assert self.is_connected
        self.robot._wire()
        return int(self.robot.torque)


class Device:
    """Two joints that obey at once; has the methods of `lerobot.robots.Robot`."""

    def __init__(self, *, bus=True):
        self.at = {"gripper.pos": 70.0, "wrist.pos": -5.0}
        self.action_features = dict.fromkeys(self.at, float)
        self.is_connected = self.torque = False
        self.is_calibrated = True
        self.fault = None
        self.sent = []
        self.config = SimpleNamespace(disable_torque_on_disconnect=True)
        if bus:
            self.bus = Bus(self)

    def _wire(self):
        if self.fault is not None:
            self.fault()

    def connect(self, calibrate=True):
        assert not calibrate  # it would ask at the terminal
        self._wire()
        self.is_connected = self.torque = True

    def get_observation(self):
        self._wire()
        return {**self.at, "camera": np.zeros((2, 2, 3))}

    def send_action(self, action):
        self._wire()
        self.sent.append(dict(action))
        if self.torque:
            self.at |= action
        return action

    def disconnect(self):
        self._wire()
        self.is_connected = False
        self.torque = self.torque and hasattr(self, "bus") and not self.bus.obeys


def wait_for(what, seconds=5.0):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.002)


def commanded(finger, what, flexion=1.0):
    """Command as a loop does until something holds."""

    def tried():
        finger.command(flexion)
        return what()

    wait_for(tried)


def test_it_starts_where_the_joint_is_and_holds_the_others():
    device = Device()
    with LeRobotFinger(device, **JOINT) as finger:
        assert finger.state().flexion == pytest.approx(0.3)
        assert device.sent[0] == {"gripper.pos": pytest.approx(70.0), "wrist.pos": -5.0}
        commanded(finger, lambda: finger.state().flexion == 1.0)
        assert device.at == {"gripper.pos": 0.0, "wrist.pos": -5.0}
        assert finger.state().sent == 1.0
    assert not device.torque
    assert not device.is_connected
    steps = -np.diff([sent["gripper.pos"] for sent in device.sent]) / 100
    # At most what the limiter allows for a pause as long as it takes one for.
    limits = finger.safety.limits
    assert steps.max() <= limits.rate * limits.longest_step * (1 + 1e-9)


@pytest.mark.parametrize("bus", [True, False])
def test_limp_takes_the_torque_and_connecting_again_gives_it_back(bus):
    device = Device(bus=bus)
    with LeRobotFinger(device, **JOINT) as finger:
        commanded(finger, lambda: finger.state().flexion > 0.5)
        finger.make_safe("a test")
        wait_for(lambda: not device.torque)
        assert device.is_connected == bus  # lerobot has no other way without a bus
        stood = dict(device.at)
        finger.command(1.0)
        assert finger.state().alert == "a test"
        assert device.at == stood
        finger.connect()
        assert finger.state().mode == "active"
        assert device.torque


def test_torque_that_comes_on_again_in_limp_is_taken():
    device = Device()
    with LeRobotFinger(device, **JOINT) as finger:
        finger.make_safe("a test")
        wait_for(lambda: not device.torque)
        device.torque = True
        wait_for(lambda: not device.torque)


def test_a_bus_that_does_not_confirm_is_told(monkeypatch):
    for name in ("_CONFIRM_TIMEOUT", "_RELEASE_TIMEOUT"):
        monkeypatch.setattr(f"ikns.finger.lerobot.{name}", 0.1)
    device = Device()
    finger = LeRobotFinger(device, **JOINT)
    finger.connect()
    device.bus.obeys = False
    finger.make_safe("a test")
    wait_for(lambda: "has not confirmed that its torque is off" in finger.state().alert)
    with pytest.raises(FingerError, match="cut its power"):
        finger.relax()
    forget(finger)  # its torque stays on, so the end of the program would ask again


@pytest.mark.parametrize("fault", ["silent", "silent, no bus", "disobedient"])
def test_relaxing_that_failed_is_tried_again(fault, monkeypatch):
    monkeypatch.setattr("ikns.finger.lerobot._RELEASE_TIMEOUT", 0.1)
    device = Device(bus=fault != "silent, no bus")
    finger = LeRobotFinger(device, **JOINT)
    finger.connect()
    connections = len(device.sent)

    def silent():
        raise ConnectionError("There is no status packet!")

    if fault == "disobedient":
        device.bus.obeys = False
    else:
        device.fault = silent
    for _ in range(2):
        with pytest.raises(FingerError, match="did not confirm that its torque is off"):
            finger.relax()
        assert device.torque  # and so it is
    device.fault = None
    if hasattr(device, "bus"):
        device.bus.obeys = True
    finger.relax()
    assert not device.torque
    assert not (hasattr(device, "bus") and device.bus.is_connected)
    assert finger.state().mode == "relaxed"
    finger.relax()  # harmless
    assert len(device.sent) == connections  # it never followed again
    with finger:
        assert device.torque


def test_a_packet_that_is_lost_at_the_end_is_sent_again():
    device = Device()
    finger = LeRobotFinger(device, **JOINT)
    finger.connect()
    switch_off, lost = device.bus.disable_torque, [None] * 3

    def noisy(motor):
        if lost:
            lost.pop()
            raise ConnectionError("There is no status packet!")
        switch_off(motor)

    device.bus.disable_torque = noisy
    finger.relax()
    assert not lost
    assert not device.torque


def test_a_robot_that_raises_leads_to_the_safe_state():
    device = Device()
    with LeRobotFinger(device, safety=Safety(safe_state="hold"), **JOINT) as finger:

        def lost():
            raise ConnectionError("There is no status packet!\nsecond line")

        device.fault = lost
        commanded(finger, lambda: finger.state().mode == "safe", 0.5)
        assert "no answer from the robot for 0.25 s" in finger.state().alert
        device.fault = None
    assert not device.torque


def test_a_robot_that_blocks_blocks_nobody(monkeypatch):
    monkeypatch.setattr("ikns.finger.lerobot._RELAX_TIMEOUT", 0.3)
    device, free = Device(), threading.Event()
    finger = LeRobotFinger(device, **JOINT)
    finger.connect()
    device.fault = free.wait
    commanded(finger, lambda: finger.state().mode == "safe", 0.5)
    assert finger.state().alert == "no answer from the robot for 0.25 s"
    with pytest.raises(FingerError, match="cut its power"):
        finger.relax()
    assert device.torque  # and so it is
    free.set()
    monkeypatch.undo()
    finger.relax()
    assert not device.torque


def test_a_robot_that_cannot_be_connected_is_told_and_may_be_tried_again():
    device = Device()
    finger = LeRobotFinger(device, **JOINT)

    def missing():
        raise OSError("could not open port /dev/x")

    device.fault = missing
    with pytest.raises(FingerError, match="gripper.pos: could not open port /dev/x"):
        finger.connect()
    device.fault, device.is_calibrated = None, False
    with pytest.raises(FingerError, match="run lerobot-calibrate"):
        finger.connect()
    assert not device.torque
    device.is_calibrated = True
    with finger:
        assert device.torque


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"joint": "elbow.pos"}, "one of gripper.pos, wrist.pos, found 'elbow.pos'"),
        ({"open": 0.0}, "two finite values"),
        ({"closed": float("nan")}, "two finite values"),
        ({"rate": 0.0}, "rate must be positive"),
    ],
)
def test_wrong_joints_are_refused(change, sentence):
    with pytest.raises(InvalidInput, match=sentence):
        LeRobotFinger(Device(), **(JOINT | change))


def test_a_robot_that_would_keep_its_torque_is_refused():
    device = Device(bus=False)
    device.config.disable_torque_on_disconnect = False
    with pytest.raises(InvalidInput, match="switches its torque off"):
        LeRobotFinger(device, **JOINT)


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("lerobot:", "lacks joint, open, closed"),
        ("lerobot:so101_follower?joint=gripper.pos&open=100", "lacks closed"),
        ("lerobot:?joint=a&open=1&closed=0", "lacks the type"),
        ("lerobot:x?joint=a&open=wide&closed=0", "open=wide, expected a number"),
    ],
)
def test_wrong_addresses_are_refused_in_a_sentence(address, sentence):
    with pytest.raises(InvalidInput, match=sentence) as error:
        open_finger(address)
    assert ". " not in str(error.value)


def test_two_joints_of_one_robot_are_no_two_fingers(monkeypatch):
    def make(kind, options):
        device = Device()
        device.config.port = options["port"]
        return device

    monkeypatch.setattr("ikns.finger.opening.make_robot", make)
    address = "lerobot:x?joint=gripper.pos&open=100&closed=0&port=/dev/{}&dof={}"
    group = open_fingers([address.format("a", 1), address.format("b", 2)], n_dof=2)
    assert group.dofs == (1, 2)
    with pytest.raises(InvalidInput, match="are the same robot"):
        open_fingers([address.format("a", 1), address.format("a", 2)], n_dof=2)


def test_without_lerobot_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "lerobot", None)
    with pytest.raises(FingerError, match=r"pip install 'ikns\[lerobot\]'"):
        open_finger("lerobot:so101_follower?joint=gripper.pos&open=100&closed=0")


def test_nothing_that_is_imported_here_needs_lerobot():
    assert "lerobot" not in sys.modules


def test_a_relayed_finger_keeps_the_laws():
    clock = SimpleNamespace(now=0.0)

    def sleep(seconds):
        clock.now += seconds

    def make():
        return RelayFinger(clock=lambda: clock.now)

    assert not check_finger(make, clock=lambda: clock.now, sleep=sleep).broken


def test_a_relayed_finger_opens_or_holds_and_is_never_limp():
    with pytest.raises(InvalidInput, match="hold or open, found limp"):
        RelayFinger(safety=Safety())
    clock = SimpleNamespace(now=0.0)
    opens = Safety(safe_state="open")
    finger = RelayFinger(safety=opens, flexion=0.8, clock=lambda: clock.now)
    finger.connect()
    finger.make_safe("a test")
    for _ in range(100):
        clock.now += 0.01
        latest = finger.latest()
    assert latest == 0.0


VALUE = st.floats(-1e6, 1e6)


@given(st.floats(0, 1), st.floats(0, 1), VALUE, VALUE)
def test_an_action_is_within_its_ends_and_meets_them(one, other, at_0, at_1):
    joints = {"gripper.pos": [at_0, at_1]}
    assert action(0.5, 0.0, joints) == {"gripper.pos": at_0}
    assert action(0.5, 1.0, joints) == {"gripper.pos": at_1}
    values = [action(0.5, f, joints)["gripper.pos"] for f in sorted((one, other))]
    # Each of the two products and their sum is rounded once.
    slack = 2 * np.spacing(max(abs(at_0), abs(at_1)))
    assert min(at_0, at_1) - slack <= min(values)
    assert max(values) <= max(at_0, at_1) + slack
    assert (values[1] - values[0]) * np.sign(at_1 - at_0) >= -slack


def test_an_action_without_joints_is_the_signals():
    assert tuple(action(-0.2, 0.4, {})) == action_names({}) == ("c", "flexion")
    assert action(-0.2, 0.4, {}) == {"c": 0.0, "flexion": 0.4}
    for wrong in ([1.0], [0.0, float("inf")], []):
        with pytest.raises(InvalidInput, match=r"two finite values for a\.pos"):
            check_joints({"a.pos": wrong})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A body that stands still, and half a second of it before all is hidden."""
    folder = tmp_path_factory.mktemp("lerobot")
    body = Skeleton.load()
    hand = np.array(list(np.ndindex(2, 2, 2))) * 0.3 - [0.1, 0.7, -0.1]
    Z, one = np.eye(7)[[1] * 8], np.ones(8)
    learned = NullSpaceMap.from_arrays(hand, Z, -one, one)
    Subject(body, learned, "right_arm", {}).save(folder / "person")
    still = np.tile(body.markers_in_world(body.neutral()), (100, 1, 1))
    markers = still + np.random.default_rng(1).normal(scale=1e-4, size=still.shape)
    markers[25:] = np.nan
    recording = Recording(np.arange(100) / 50, markers, body.marker_set.labels)
    write_c3d(folder / "hidden.c3d", recording)
    return folder


def test_the_signal_holds_what_does_not_count_and_tells_its_safe_state(folder):
    said = []
    source = f"replay:{folder / 'hidden.c3d'}"
    signal = LiveSignal(folder / "person", source, tell=said.append)
    signal.start()
    try:
        c, _ = signal.latest()
        assert np.isfinite(c)
        wait_for(lambda: any("FINGER STOPPED: no valid pose" in line for line in said))
        stopped = signal.latest()
        wait_for(lambda: any("has ended; flexion stays" in line for line in said))
        assert signal.latest() == stopped
    finally:
        signal.stop()
    assert not signal.running


def test_an_arm_that_is_not_seen_is_not_waited_for_for_ever(folder, monkeypatch):
    recording = read(folder / "hidden.c3d")
    monkeypatch.setattr("ikns.live.lerobot.signal._FIRST_TIMEOUT", 0.3)
    hidden = recording.markers.copy()
    hidden[:, [label.startswith("R") for label in recording.labels]] = np.nan
    no_arm = Recording(recording.time, hidden, recording.labels)
    write_c3d(folder / "no_arm.c3d", no_arm)
    signal = LiveSignal(folder / "person", f"replay:{folder / 'no_arm.c3d'}")
    with pytest.raises(StreamError, match="no frame counted"):
        signal.start()
    assert not signal.running


def test_another_program_keeps_its_garbage_collector():
    assert gc.isenabled()
    with realtime_priority(exclusive=False):
        assert gc.isenabled()
    with realtime_priority():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_what_ends_the_signal_is_raised_where_it_is_asked_for(folder):
    with pytest.raises(InvalidInput, match="unknown source 'x'"):
        LiveSignal(folder / "person", "x").start()
    with pytest.raises(IknsError, match="nowhere"):
        LiveSignal(folder / "nowhere", "x").start()
