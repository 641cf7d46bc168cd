"""The simulated servo behind its bytes, with a clock of its own."""

import math

import pytest

from ikns.errors import InvalidInput
from ikns.finger.emulator import Servo
from ikns.finger.emulator.packet import Packet, Parser, encode
from ikns.finger.models import MODELS


class Desk:
    """A servo, a clock, and somebody who speaks to it."""

    def __init__(self, model="xl430", **options):
        self.now = 0.0
        self.servo = Servo(model, clock=lambda: self.now, **options)
        self.model = MODELS[model]
        self.protocol = self.model.protocol

    def say(self, instruction, data=b"", *, to=1):
        packet = encode(Packet(to, instruction, data), self.protocol)
        replies = self.servo.receive(packet)
        parser = Parser(self.protocol, status=True)
        return [p for reply in replies for p in parser.feed(reply.data)]

    def place(self, name, count=False):
        register = self.model[name]
        size = 2 if self.protocol == 2 else 1
        place = register.address.to_bytes(size, "little")
        return place + register.size.to_bytes(size, "little") if count else place

    def write(self, name, value, *, instruction=3):
        data = self.place(name) + self.model[name].to_bytes(value)
        [status] = self.say(instruction, data)
        return status.error

    def read(self, name):
        [status] = self.say(2, self.place(name, count=True))
        assert status.error is not None
        return self.model[name].from_bytes(status.data)

    def wait(self, duration, *, talking=True):
        end = self.now + duration
        while self.now < end - 1e-9:
            self.now = min(self.now + 0.01, end)
            if talking:
                self.say(1)
            else:
                self.servo.advance()


@pytest.fixture(params=list(MODELS))
def desk(request):
    return Desk(request.param, baud=57600)


def test_it_moves_only_under_torque(desk):
    start = desk.servo.motor.position
    goal = desk.model.highest // 4
    if desk.protocol == 2:  # an AX-12 takes up torque with a goal
        assert desk.write("goal_position", goal) == 0
        desk.wait(1.0)
        assert desk.servo.motor.position == start
    desk.write("torque_enable", 1)
    desk.write("goal_position", goal)
    desk.wait(1.5)
    assert desk.read("present_position") == pytest.approx(goal, abs=1)
    assert not desk.read("moving")


def test_permanent_memory_is_locked_under_torque(desk):
    assert desk.write("max_position_limit", 1000) == 0
    desk.write("torque_enable", 1)
    assert desk.write("max_position_limit", 900) != 0
    assert desk.read("max_position_limit") == 1000


def test_a_goal_beyond_the_limits_is_refused(desk):
    desk.write("max_position_limit", 600)
    error = desk.write("goal_position", 601)
    assert error == (6 if desk.protocol == 2 else 2)  # limit; angle limit bit
    assert list(desk.servo.goals) == []


def test_a_broken_packet_does_nothing(desk):
    data = bytearray(encode(Packet(1, 3, desk.place("led") + b"\1"), desk.protocol))
    data[-1] ^= 1
    [reply] = desk.servo.receive(bytes(data))
    [status] = Parser(desk.protocol, status=True).feed(reply.data)
    assert status.error == (3 if desk.protocol == 2 else 16)
    assert desk.read("led") == 0


def test_a_registered_write_waits_for_action(desk):
    assert desk.write("led", 1, instruction=4) == 0
    assert desk.read("led") == 0
    assert desk.read("registered_instruction") == 1
    desk.say(5)
    assert desk.read("led") == 1
    [status] = desk.say(5)  # nothing is registered any more
    assert status.error != 0


def test_others_and_broadcasts_are_heard_but_not_answered(desk):
    assert desk.say(1, to=2) == []
    place = desk.place("led")
    assert desk.say(3, place + b"\1", to=254) == []
    assert desk.read("led") == 1
    assert [status.id for status in desk.say(1, to=254)] == [1]


def test_factory_reset_is_refused(desk):
    desk.write("led", 1)
    [status] = desk.say(6, b"\xff")
    assert status.error != 0
    assert desk.read("led") == 1


def test_the_status_return_level_is_kept(desk):
    desk.say(3, desk.place("status_return_level") + b"\1")
    assert desk.say(3, desk.place("led") + b"\1") == []
    assert desk.read("led") == 1
    assert len(desk.say(1)) == 1


def test_an_obstacle_stops_it_and_its_effort_rises(desk):
    middle = desk.servo.motor.position
    desk.servo.motor.obstacles = (-math.inf, middle + 50)
    desk.write("goal_pwm", desk.model["goal_pwm"].upper // 2)
    desk.write("torque_enable", 1)
    desk.write("goal_position", round(middle + 300))
    desk.wait(1.0)
    assert desk.read("present_position") == middle + 50
    assert desk.servo.motor.effort == pytest.approx(0.5, abs=0.01)


def test_pushing_with_all_it_has_is_an_overload(desk):
    middle = desk.servo.motor.position
    desk.servo.motor.obstacles = (-math.inf, middle)
    desk.write("torque_enable", 1)
    desk.write("goal_position", round(middle + 300))
    desk.wait(3.0)
    assert not desk.servo.torque
    [status] = desk.say(1)
    assert status.error & (0x80 if desk.protocol == 2 else 0x20)
    desk.write("torque_enable", 1)
    assert not desk.servo.torque  # not before it is started again


def test_a_profile_keeps_its_velocity_and_acceleration():
    desk = Desk("xl430")
    desk.write("profile_velocity", 100)
    desk.write("profile_acceleration", 50)
    desk.write("torque_enable", 1)
    desk.write("goal_position", 3000)
    places = []
    for _ in range(200):
        desk.now += 0.001
        desk.say(1)
        places.append(desk.servo.motor.profile)
    unit = desk.model
    speed = [1000 * (b - a) for a, b in zip(places, places[1:], strict=False)]
    change = [1000 * (b - a) for a, b in zip(speed, speed[1:], strict=False)]
    # Both are limits of the law behind the profile; 1e-6 covers rounding of a
    # thousandth's difference of positions of 4096.
    assert max(speed) <= 100 * unit.velocity_unit * (1 + 1e-6)
    assert max(map(abs, change)) <= 50 * unit.acceleration_unit * (1 + 1e-6) + 1e-3
    assert max(speed) > 90 * unit.velocity_unit


class TestWatchdog:
    @pytest.fixture
    def moving(self):
        desk = Desk("xl430")
        desk.write("profile_velocity", 50)
        desk.write("torque_enable", 1)
        desk.write("goal_position", 4000)
        desk.write("bus_watchdog", 5)  # 0.1 s
        desk.wait(0.3)
        assert desk.servo.motor.velocity > 0
        return desk

    def test_silence_stops_it(self, moving):
        moving.wait(0.09, talking=False)
        assert not moving.servo.watchdog_error
        moving.wait(0.1, talking=False)
        assert moving.servo.watchdog_error
        place = moving.servo.motor.position
        moving.wait(1.0, talking=False)
        # It stood within the 10 ms between two looks of the desk's clock, and slows
        # down within as much again.
        assert moving.servo.motor.position - place < 0.1 * 50 * 15.7
        stood = moving.servo.motor.position
        moving.wait(1.0, talking=False)
        assert moving.servo.motor.position == pytest.approx(stood, abs=1e-6)

    def test_its_goals_are_then_locked_until_it_is_cleared(self, moving):
        moving.wait(0.2, talking=False)
        assert moving.read("bus_watchdog") == -1
        assert moving.write("goal_position", 2000) == 4
        assert moving.write("bus_watchdog", 0) == 0
        assert moving.write("goal_position", 2000) == 0

    def test_any_instruction_keeps_it_going(self, moving):
        for _ in range(30):
            moving.now += 0.05
            moving.say(1, to=9)  # even one for somebody else
        assert not moving.servo.watchdog_error


def test_a_reboot_forgets_what_is_not_permanent():
    desk = Desk("xl430")
    desk.write("min_position_limit", 100)
    desk.write("led", 1)
    desk.servo.overheat()
    [status] = desk.say(8)
    assert desk.say(1) == []  # it is starting
    desk.servo.motor.temperature = 30.0
    desk.now += 0.5
    assert desk.read("led") == 0
    assert desk.read("min_position_limit") == 100
    assert desk.read("hardware_error_status") == 0


def test_alerts_show_in_every_status_and_in_their_register():
    desk = Desk("xl430")
    desk.write("torque_enable", 1)
    desk.servo.overheat()
    [status] = desk.say(1)
    assert status.error == 0x80
    assert desk.read("hardware_error_status") == 1 << 2
    assert not desk.servo.torque


def test_partial_and_unknown_writes_are_refused():
    desk = Desk("xl430")
    goal = desk.place("goal_position")
    [status] = desk.say(3, goal + b"\0\0")
    assert status.error == 5
    [status] = desk.say(3, b"\x0f\x00\x01")  # nothing lies at 15
    assert status.error == 7
    [status] = desk.say(3, desk.place("present_position") + b"\0\0\0\0")
    assert status.error == 7
    [status] = desk.say(2, b"\x00\x02\x04\x00")  # beyond the table
    assert status.error == 7


def test_several_servos_take_their_parts_of_sync_and_bulk():
    desk = Desk("xl430", id=2)
    goal = desk.place("goal_position", count=True)
    one, other = (7).to_bytes(4, "little"), (99).to_bytes(4, "little")
    assert desk.say(0x83, goal + b"\1" + one + b"\2" + other, to=254) == []
    assert desk.servo.memory["goal_position"] == 99
    [status] = desk.say(0x82, goal + b"\1\2", to=254)
    assert (status.id, status.data) == (2, other)
    assert desk.say(0x93, b"\2" + goal + one, to=254) == []
    [status] = desk.say(0x92, b"\2" + goal, to=254)
    assert status.data == one
    assert desk.say(0x92, b"\1" + goal, to=254) == []


def test_impossible_servos_are_refused():
    with pytest.raises(InvalidInput, match=r"id must be 0 to 252, not 253"):
        Servo("xl430", id=253)
    with pytest.raises(InvalidInput, match=r"no rate 12345, only 9600"):
        Servo("xl430", baud=12345)
    with pytest.raises(InvalidInput, match=r"no rate 2000000, only 7843"):
        Servo("ax12", baud=2000000)
