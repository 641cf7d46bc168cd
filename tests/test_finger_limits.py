"""Whatever is asked, and whenever, what is sent keeps its limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.finger import Limiter, Limits, Safety
from ikns.finger.guard import Guard
from ikns.finger.limiter import approach

anything = st.floats() | st.floats(-0.5, 1.5) | st.sampled_from([0.0, 1.0])
# Shorter steps than 0.1 ms would make a rounded difference quotient mean nothing.
durations = st.floats(1e-4, 0.3) | st.sampled_from([0.0, 1e-3, 0.01, 0.1, 5.0])
limits = st.builds(
    Limits,
    lower=st.floats(0, 0.4),
    upper=st.floats(0.6, 1),
    rate=st.floats(0.01, 50),
    acceleration=st.floats(0.1, 1000),
)
# Positions of size 1 are rounded at 2.2e-16, so velocities at 4.4e-16 / 1e-4, and
# their differences at twice that; ten times as much covers the limiter's own sums.
ROUNDING = 1e-10


@given(limits, st.floats(-1, 2), st.lists(st.tuples(anything, durations), max_size=60))
def test_range_rate_and_acceleration_are_never_exceeded(limits, start, steps):
    limiter = Limiter(limits, start)
    position, velocity = limiter.position, 0.0
    for target, dt in steps:
        before, position = position, limiter.step(target, dt)
        assert limits.lower <= position <= limits.upper
        if dt == 0:
            assert position == before
            continue
        if dt > limits.longest_step:  # it had come to rest
            dt, velocity = limits.longest_step, 0.0
        last, velocity = velocity, (position - before) / dt
        assert abs(velocity) <= limits.rate + ROUNDING
        assert abs(velocity - last) <= limits.acceleration * dt + ROUNDING


@given(
    st.builds(Limits, rate=st.floats(0.3, 50), acceleration=st.floats(1, 1000)),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(5e-3, 0.05),
)
def test_it_arrives_without_passing_its_target(limits, start, target, dt):
    limiter = Limiter(limits, start)
    start = limiter.position
    target = min(max(target, limits.lower), limits.upper)
    distance = abs(target - start)
    # Speeding up and slowing down cost the rate over the acceleration at most; a step
    # before each of three phases is lost, and the last bit of the way takes steps that
    # shrink with the distance.
    enough = distance / limits.rate + 2 * math.sqrt(distance / limits.acceleration)
    enough += limits.rate / limits.acceleration + 50 * dt
    path = [start]
    for _ in range(math.ceil(enough / dt)):
        path.append(limiter.step(target, dt))
    low, high = min(start, target), max(start, target)
    assert low - 1e-12 <= min(path)
    assert max(path) <= high + 1e-12
    assert path[-1] == pytest.approx(target, abs=1e-6)


def test_the_way_takes_as_long_as_the_closed_form_says():
    limits = Limits(rate=2.0, acceleration=20.0)
    limiter, dt, steps = Limiter(limits, 0.0), 1e-4, 0
    while limiter.position < 1 - 1e-6:
        limiter.step(1.0, dt)
        steps += 1
    # Distance / rate + rate / acceleration; the last millionth of the way takes
    # sqrt(2e-6 / 20) = 0.3 ms less, whole steps cost up to one each at the three turns.
    assert steps * dt == pytest.approx(1 / 2.0 + 2.0 / 20.0, abs=8e-4)


@given(
    st.lists(durations, min_size=1, max_size=30), st.sampled_from([math.nan, math.inf])
)
def test_without_a_number_it_brakes_and_stays(steps, nothing):
    limits = Limits()
    limiter = Limiter(limits, 0.0)
    for _ in range(20):
        limiter.step(1.0, 0.01)
    start, speed = limiter.position, limiter.velocity
    for dt in steps:
        limiter.step(nothing, dt)
        far = limiter.position - start
        assert 0 <= far <= speed**2 / (2 * limits.acceleration) + ROUNDING
    for _ in range(2):
        limiter.step(nothing, 0.1)
    stays = limiter.position
    assert limiter.step(nothing, 0.05) == stays


def test_a_long_silence_is_no_leave_for_a_long_step():
    limits = Limits(rate=2.0, acceleration=1000.0)
    assert Limiter(limits, 0.0).step(1.0, 3600.0) <= 2.0 * limits.longest_step


def test_the_law_of_approach_leaves_room_to_brake():
    velocity = approach(0.1, 0.0, 0.01, rate=10.0, acceleration=5.0)
    assert velocity <= 0.05  # the acceleration
    velocity = approach(0.1, 10.0, 1.0, rate=10.0, acceleration=5.0)
    assert velocity == 5.0  # brakes hardest: too late


@pytest.mark.parametrize(
    "wrong",
    [
        {"lower": -0.1},
        {"lower": 0.7, "upper": 0.3},
        {"upper": 1.1},
        {"rate": 0.0},
        {"rate": math.nan},
        {"acceleration": -1.0},
        {"longest_step": math.inf},
    ],
)
def test_limits_that_do_not_limit_are_refused(wrong):
    with pytest.raises(InvalidInput, match=r"must"):
        Limits(**wrong)
    with pytest.raises(InvalidInput, match=r"finite flexion"):
        Limiter(Limits(), math.nan)


events = st.one_of(
    st.tuples(st.just("command"), anything),
    st.tuples(st.just("command"), anything),
    st.tuples(st.just("tick"), st.none()),
    st.tuples(st.just("measured"), anything),
    st.tuples(st.just("fail"), st.booleans()),
    st.tuples(st.just("relax"), st.none()),
)


@given(
    st.sampled_from(["hold", "open", "limp"]),
    st.floats(0, 1),
    st.lists(st.tuples(durations, events), max_size=60),
)
def test_nothing_that_happens_breaks_a_limit(safe_state, start, happenings):
    safety = Safety(safe_state=safe_state)
    limits = safety.limits
    guard, now = Guard(safety), 0.0
    assert math.isnan(guard.goal)
    guard.start(now, start)
    goal, at = guard.goal, now
    for passed, (what, value) in happenings:
        now += passed
        mode = guard.mode
        match what:
            case "command":
                sent = guard.command(now, value)
                assert sent == guard.goal or math.isnan(guard.goal)
            case "tick":
                guard.tick(now)
            case "measured":
                guard.measured(now, value)
            case "fail":
                guard.fail("a test", limp=value)
            case "relax":
                guard.relax()
        if mode != "active":
            assert guard.mode in (mode, "relaxed")  # never active by itself
        if not guard.torque:
            assert math.isnan(guard.goal)
            assert math.isnan(guard.command(now, 0.5))
            return
        before, goal = goal, guard.goal
        assert limits.lower <= goal <= limits.upper
        # Steps are taken from the time of the last step, not of the last event.
        assert abs(goal - before) <= limits.rate * (now - at) + ROUNDING
        if goal != before:
            at = now


class TestGuard:
    def make(self, flexion=0.5, **options):
        guard = Guard(Safety(**options))
        guard.start(0.0, flexion)
        return guard

    def drive(self, guard, target, start, end, measured=None, stopped=min):
        now = start
        while now < end:
            now += 0.01
            guard.command(now, target)
            position = guard.goal if measured is None else stopped(guard.goal, measured)
            guard.measured(now, position)
        return now

    def test_a_caller_that_falls_silent_makes_it_safe(self):
        guard = self.make()
        guard.tick(0.49)
        assert guard.mode == "active"
        guard.tick(0.51)
        assert (guard.mode, guard.reason) == ("safe", "no command for 0.5 s")
        guard.command(0.52, 1.0)
        assert guard.mode == "safe"
        guard.start(0.6, 0.5)
        assert (guard.mode, guard.reason) == ("active", "")

    def test_safe_states_hold_open_or_let_go(self):
        for state in ("hold", "open", "limp"):
            guard = self.make(0.8, safe_state=state)
            guard.fail("a test")
            for i in range(200):
                guard.tick(0.01 * i)
            if state == "limp":
                assert math.isnan(guard.goal)
            else:
                assert guard.goal == pytest.approx(0.8 if state == "hold" else 0.0)

    def test_a_complaint_of_the_device_takes_all_torque(self):
        guard = self.make(safe_state="hold")
        guard.fail("no command")
        guard.fail("overheating", limp=True)
        assert not guard.torque
        assert guard.reason == "no command"  # the first reason stays

    def test_pushing_for_too_long_becomes_a_light_grip(self):
        guard = self.make(0.0)
        now = self.drive(guard, 1.0, 0.0, 0.9, measured=0.4)
        assert not guard.stalled
        now = self.drive(guard, 1.0, now, 3.0, measured=0.4)
        assert guard.stalled
        assert guard.goal == pytest.approx(0.4 + guard.safety.grip, abs=1e-6)
        now = self.drive(guard, 0.2, now, now + 1.0)
        assert not guard.stalled
        assert guard.goal == pytest.approx(0.2)
        self.drive(guard, 1.0, now, now + 1.0)
        assert guard.goal == pytest.approx(1.0)  # free again

    def test_pushing_open_for_too_long_ends_as_lightly(self):
        guard = self.make(1.0)
        now = self.drive(guard, 0.0, 0.0, 0.9, measured=0.6, stopped=max)
        assert not guard.stalled
        now = self.drive(guard, 0.0, now, 3.0, measured=0.6, stopped=max)
        assert guard.stalled
        assert guard.goal == pytest.approx(0.6 - guard.safety.grip, abs=1e-6)
        self.drive(guard, 0.8, now, now + 1.0)
        assert not guard.stalled
        assert guard.goal == pytest.approx(0.8)

    def test_an_object_that_gives_way_is_followed(self):
        guard = self.make(0.0)
        now = self.drive(guard, 1.0, 0.0, 3.0, measured=0.4)
        assert guard.stalled
        self.drive(guard, 1.0, now, now + 1.0, measured=0.9)
        assert guard.goal > 0.8

    def test_a_stalled_finger_that_becomes_safe_still_only_grips(self):
        guard = self.make(0.0, safe_state="hold", stall_timeout=10.0)
        now = self.drive(guard, 1.0, 0.0, 1.0, measured=0.4)
        guard.fail("a test")
        while now < 12.0:
            now += 0.01
            guard.measured(now, 0.4)
            guard.tick(now)
        assert guard.goal == pytest.approx(0.4 + guard.safety.grip, abs=1e-6)

    @pytest.mark.parametrize(
        "wrong",
        [
            {"safe_state": "closed"},
            {"command_timeout": 0.0},
            {"silence_timeout": math.nan},
            {"stall_timeout": math.inf},
            {"grip": 0.2},
        ],
    )
    def test_time_outs_that_never_end_are_refused(self, wrong):
        with pytest.raises(InvalidInput, match=r"must"):
            Safety(**wrong)
