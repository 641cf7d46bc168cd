"""The simulated finger, its shape, its URDF, its address, and the laws."""

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput
from ikns.finger import (
    DynamixelFinger,
    FingerError,
    Safety,
    SimulatedFinger,
    check_finger,
    open_finger,
)
from ikns.finger.geometry import (
    FULL_FLEXION,
    MODULES,
    WIDEST,
    flexion_at,
    joint_angles,
    opening,
)
from ikns.finger.laws import LAWS
from ikns.finger.relax_at_exit import forget

URDF = Path(__file__).parents[1] / "urdf" / "finger.urdf"


class Time:
    """A clock that moves on request."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, duration):
        self.now += duration


@pytest.fixture
def time():
    return Time()


def drive(time, finger, target, duration):
    sent = []
    for _ in range(round(duration / 0.01)):
        time.sleep(0.01)
        sent.append(finger.command(target))
    return np.array(sent)


def test_the_urdf_has_the_shape_that_is_computed_with():
    robot = Robot.load(URDF, "finger_tip")
    assert robot.joint_names == tuple(f"flexion_{i + 1}" for i in range(MODULES))
    # The file gives the limit to six decimals.
    np.testing.assert_allclose(robot.upper, FULL_FLEXION, atol=5e-7)
    np.testing.assert_array_equal(robot.lower, 0)
    for flexion in np.linspace(0, 1, 11):
        tip = robot.pose(joint_angles(flexion))[0]
        # Sums of six products of order 0.1 m.
        assert WIDEST + tip[1] == pytest.approx(opening(flexion), abs=1e-15)
        assert tip[2] == pytest.approx(0, abs=1e-15)


def test_inertias_are_those_of_bodies():
    model = pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())
    assert model.njoints == MODULES + 2
    for inertia in list(model.inertias)[1:]:
        assert inertia.mass > 0
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2]


def test_the_opening_only_shrinks_and_takes_the_objects_of_the_paper():
    widths = [opening(flexion) for flexion in np.linspace(0, 1, 1001)]
    assert (np.diff(widths) < 0).all()
    for width in (0.05, 0.06, 0.075, 0.097):
        assert opening(flexion_at(width)) == pytest.approx(width, abs=1e-12)
    with pytest.raises(InvalidInput, match=r"200 mm does not fit, the finger opens to"):
        flexion_at(0.2)


def test_it_keeps_the_laws(time):
    report = check_finger(
        lambda: SimulatedFinger(clock=time), clock=time, sleep=time.sleep
    )
    assert report.kept == tuple(LAWS)


def test_a_finger_that_breaks_laws_is_found_out(time):
    class Careless(SimulatedFinger):
        def command(self, flexion):
            super().command(flexion)
            return flexion

        def relax(self):
            self._connected = False
            forget(self)  # so that no later test finds it

    def make():
        return Careless(clock=time)

    options = {"clock": time, "sleep": time.sleep}
    broken = check_finger(make, **options, strict=False).broken
    for law in (
        "sends nothing before it is connected",
        "starts softly from where it is",
        "stays in its range",
        "keeps to its rate",
        "holds when the command is not finite",
        "relaxes, also when repeated",
        "relaxes after an exception",
    ):
        assert law in broken
    with pytest.raises(FingerError, match=r"violates a law: sends nothing before it"):
        check_finger(make, **options)


def test_an_object_stops_it_and_the_current_rises(time):
    with SimulatedFinger(object_width=0.06, clock=time) as finger:
        drive(time, finger, 0.2, 1.0)
        free = finger.state()
        drive(time, finger, 1.0, 0.5)
        pushing = finger.state()
        drive(time, finger, 1.0, 3.0)
        holding = finger.state()
    assert free.current == pytest.approx(0, abs=0.01)
    for state in (pushing, holding):
        assert opening(state.flexion) == pytest.approx(0.06, abs=1e-9)
    assert pushing.load == pytest.approx(0.5)  # all it may
    assert not pushing.stalled
    assert holding.stalled
    assert 0 < holding.load < pushing.load
    assert holding.sent == pytest.approx(holding.flexion + finger.safety.grip, abs=1e-6)


def test_an_object_that_is_taken_away_lets_it_close(time):
    with SimulatedFinger(object_width=0.06, clock=time) as finger:
        drive(time, finger, 1.0, 3.0)
        finger.object_width = None
        drive(time, finger, 1.0, 2.0)
        assert finger.opening == pytest.approx(0, abs=1e-3)


def test_it_does_the_same_again(time):
    def run():
        clock = Time()
        rng = np.random.default_rng(7)
        with SimulatedFinger(clock=clock, object_width=0.07) as finger:
            states = []
            for target in rng.uniform(-0.5, 1.5, 300):
                clock.sleep(rng.uniform(0, 0.02))
                finger.command(target)
                states.append(finger.state())
        return states

    for one, other in zip(run(), run(), strict=True):
        assert repr(one) == repr(other)


def test_the_motor_is_no_faster_than_it_can_be(time):
    with SimulatedFinger(clock=time) as finger:
        finger.command(1.0)
        places = []
        for _ in range(100):
            time.sleep(0.01)
            finger.command(1.0)
            places.append(finger.state().flexion)
    assert max(np.diff(places)) <= 1.9 * 0.01 + 1e-12
    assert places[-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("safe_state", ["hold", "open", "limp"])
def test_a_caller_that_hangs_leaves_it_in_its_safe_state(time, safe_state):
    safety = Safety(safe_state=safe_state)
    with SimulatedFinger(clock=time, safety=safety) as finger:
        drive(time, finger, 0.8, 1.5)
        time.sleep(60)
        state = finger.state()
    assert state.mode == "safe"
    assert state.alert == "no command for 0.5 s"
    if safe_state == "open":
        assert state.flexion == pytest.approx(0, abs=1e-6)
    else:
        assert state.flexion == pytest.approx(0.8, abs=1e-3)
    assert math.isnan(state.sent) == (safe_state == "limp")
    assert finger.state().mode == "relaxed"


def test_addresses_make_fingers():
    assert isinstance(open_finger("sim:"), SimulatedFinger)
    finger = open_finger("sim:width=60&effort=0.3&safe=open")
    assert finger.object_width == pytest.approx(0.06)
    assert finger.safety.safe_state == "open"
    given = Safety(safe_state="hold", command_timeout=2.0)
    assert open_finger("sim:", safety=given).safety is not None
    assert open_finger("sim:", safety=given).safety == given
    address = "dynamixel:/dev/ttyUSB0?id=3&baud=1000000&model=ax12&open=900&closed=100"
    finger = open_finger(address)
    assert isinstance(finger, DynamixelFinger)
    assert finger.resolution == 1 / 800


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("gpio:7", "expected sim:, dynamixel:PORT, ros2:TOPIC or lerobot:TYPE"),
        ("sim", "unknown finger 'sim'"),
        ("sim:width=fat", "width=fat, expected a number"),
        ("sim:width", "should end in options like name=value"),
        ("sim:width=500", "500 mm does not fit"),
        ("sim:effort=2", r"effort must be in \(0, 1\], not 2"),
        ("sim:safe=closed", "safe state must be hold, open or limp, not 'closed'"),
        ("sim:id=1", "unknown option 'id', expected width"),
        ("dynamixel:", "names no port"),
        ("dynamixel:/dev/x?id=300", "id must be 0 to 252, not 300"),
        ("dynamixel:/dev/x?model=hs53", "unknown servo model 'hs53'"),
        ("dynamixel:/dev/x?open=5&closed=5", "two positions from 0 to 4095"),
        ("dynamixel:/dev/x?closed=5000", "two positions from 0 to 4095"),
        ("dynamixel:/dev/x?effort=0", "effort must be in"),
        ("dynamixel:/dev/x?watchdog=9", "watchdog must be 0.02 to 2.54 s"),
    ],
)
def test_wrong_addresses_are_refused_in_a_sentence(address, sentence):
    with pytest.raises(InvalidInput, match=sentence) as error:
        open_finger(address)
    assert str(error.value).endswith(".")
    assert ". " not in str(error.value)
