import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.live.control.safety import SafetyMachine
from ikns.live.control.settings import ControlSettings
from ikns.live.control.smoothing import OneEuro

# --- the state machine ---------------------------------------------------------------

CALLS = ("arm", "activate", "pose", "check", "stop", "arm_again", "disarm")
#: Every way there is, written down a second time.
WAYS = {
    ("disarmed", "armed"),
    ("armed", "active"),
    ("armed", "safe"),
    ("armed", "disarmed"),
    ("active", "holding"),
    ("active", "safe"),
    ("active", "disarmed"),
    ("holding", "active"),
    ("holding", "safe"),
    ("holding", "disarmed"),
    ("safe", "armed"),
    ("safe", "disarmed"),
}


def started(**times):
    machine = SafetyMachine(**times)
    machine.arm(0.0)
    machine.pose(0.0)
    machine.activate(0.0)
    assert machine.state == "active"
    return machine


def test_only_a_request_leads_out_of_the_safe_state():
    machine = started()
    machine.stop(0.1, "button")
    for name in ("arm", "activate", "pose", "check", "stop"):
        call(machine, name, 0.2)
        assert machine.state == "safe"
    (change,) = machine.arm_again(0.3)
    assert change[1:] == ("safe", "armed", "re-arming requested")
    assert machine.arm_again(0.4) == ()
    # It moves only once poses come, as after the first time.
    assert machine.activate(0.4) == ()
    machine.pose(0.5)
    machine.activate(0.5)
    assert machine.state == "active"


def call(machine, name, now):
    return (
        machine.stop(now, "button") if name == "stop" else getattr(machine, name)(now)
    )


@given(
    st.lists(
        st.tuples(st.sampled_from(CALLS), st.floats(0.0, 0.3, allow_nan=False)),
        max_size=30,
    ),
    st.floats(1e-9, 0.1),
)
def test_the_watchdog_acts_at_its_deadline_and_not_before(calls, margin):
    machine, now = SafetyMachine(), 0.0
    for name, after in calls:
        now += after
        call(machine, name, now)
    due = machine.deadline
    if due == math.inf:
        assert machine.check(now + 1e9) == ()
        return
    # After a second of silence due lies in the past: then it is due at once.
    if due - margin > now:
        assert machine.check(due - margin) == ()
    assert len(machine.check(max(due, now) + margin)) == 1


@given(
    st.lists(
        st.tuples(st.sampled_from(CALLS), st.floats(-0.05, 0.3, allow_nan=False)),
        max_size=60,
    )
)
def test_only_the_ways_of_the_plan_are_taken(calls):
    machine, now, last_pose = SafetyMachine(), 0.0, -math.inf
    for name, after in calls:
        now += after  # sometimes backwards
        before = machine.state
        for change in call(machine, name, now):
            assert change.before == before
            assert (before, change.after) in WAYS
            assert change.reason
            before = change.after
        assert machine.state == before
        if name == "pose" and machine.state != "safe":
            last_pose = max(last_pose, now)
        if name in ("pose", "check"):
            machine.check(now)
            silence = now - last_pose
            # Rounding of times around a second.
            if machine.state == "active":
                assert silence <= machine.hold_after + 1e-12
            if machine.state == "holding":
                assert silence <= machine.safe_after + 1e-12
        if name == "stop":
            assert machine.state in ("safe", "disarmed")


def test_silence_holds_and_then_makes_safe():
    machine = started()
    assert machine.check(0.1) == ()
    (change,) = machine.check(0.101)
    assert change[1:] == ("active", "holding", "no valid pose for 0.101 s")
    assert machine.check(0.5) == ()
    assert machine.check(0.501)[0].after == "safe"


def test_poses_that_come_back_in_time_let_it_go_on():
    machine = started()
    machine.check(0.3)
    assert machine.pose(0.4)[0][1:3] == ("holding", "active")


def test_a_pose_after_too_long_a_silence_does_not_bring_it_back():
    machine = started()
    # Nobody asked the watchdog in between.
    assert machine.pose(2.0)[0].after == "safe"
    assert machine.pose(2.01) == ()
    assert machine.activate(2.01) == ()
    assert machine.arm(2.01) == ()
    assert machine.state == "safe"


def test_a_late_pose_within_the_safe_time_is_reported_as_it_was():
    machine = started()
    held, back = machine.pose(0.3)
    assert held[1:3] == ("active", "holding")
    assert back[1:3] == ("holding", "active")


def test_it_does_not_start_without_poses():
    machine = SafetyMachine()
    machine.arm(0.0)
    assert machine.activate(0.0) == ()
    machine.pose(0.0)
    assert machine.activate(0.2) == ()
    assert machine.state == "armed"


def test_a_clock_that_jumps_back_is_not_believed():
    machine = started()
    machine.pose(10.0)  # too late: safe
    machine.disarm(10.0)
    machine.arm(10.0)
    machine.pose(10.0)
    machine.activate(3.0)
    assert machine.check(3.0) == ()
    assert machine.check(10.2)[0].after == "holding"


def test_a_time_that_is_no_number_is_not_believed():
    machine = started()
    assert machine.check(math.nan) == ()
    assert machine.state == "active"


@pytest.mark.parametrize("times", [(0.0, 1.0), (0.2, 0.1), (0.1, math.inf)])
def test_times_that_make_no_sense_are_refused(times):
    with pytest.raises(InvalidInput, match="0 s < hold_after"):
        SafetyMachine(hold_after=times[0], safe_after=times[1])


# --- smoothing -----------------------------------------------------------------------

STEPS = st.lists(
    st.tuples(
        st.one_of(st.floats(-10, 10), st.just(math.nan)),
        st.floats(-0.01, 0.1, allow_nan=False),
    ),
    max_size=50,
)


@given(STEPS)
@example([(0.0, 0.0), (1.0, 5e-324)])
@example([(0.0, 0.0), (1e300, 1e-12), (1.0, 0.01)])
def test_smoothing_stays_between_what_came_in(steps):
    smooth = OneEuro()
    seen = []
    for x, dt in steps:
        value = smooth.step(x, dt)
        if math.isfinite(x):
            seen.append(x)
        if seen:
            # A convex combination, rounded at each of 50 steps.
            off = 1e-14 * max(1.0, *map(abs, seen))
            assert min(seen) - 10 * off <= value <= max(seen) + 10 * off
            assert smooth.delay >= 0
        else:
            assert math.isnan(value)


def test_without_beta_it_is_a_low_pass_of_first_order():
    dt, cutoff = 0.01, 2.0
    smooth = OneEuro(cutoff=cutoff, beta=0.0)
    smooth.step(0.0, dt)
    out = [smooth.step(1.0, dt) for _ in range(100)]
    # Backward Euler: each step leaves 1 / (1 + w dt) of the distance.
    left = (1 + 2 * np.pi * cutoff * dt) ** -np.arange(1.0, 101.0)
    np.testing.assert_allclose(out, 1 - left, atol=1e-14)


def test_delay_is_how_far_a_ramp_is_behind():
    dt, slope = 0.01, 0.3
    smooth = OneEuro(cutoff=1.0, beta=0.5)
    for k in range(3000):
        value = smooth.step(slope * k * dt, dt)
    # After 30 s the ramp is followed steadily: what is left of the start is exp(-100).
    assert slope * 2999 * dt - value == pytest.approx(slope * smooth.delay, rel=1e-9)


def test_what_the_live_defaults_cost_is_what_their_docstring_says():
    dt, cutoff, beta = 0.01, ControlSettings().cutoff, ControlSettings().beta
    resting = OneEuro(cutoff=cutoff, beta=0.0)
    rng = np.random.default_rng(0)
    noise = np.array([resting.step(x, dt) for x in rng.normal(size=20_000)])
    # A quarter: the noise of 20 000 samples, some 9 of them alike, is known to 2 %.
    assert noise.std() == pytest.approx(0.243, rel=0.08)
    assert resting.delay == pytest.approx(0.080, abs=0.0005)
    moving = OneEuro(cutoff=cutoff, beta=beta)
    for k in range(3000):
        moving.step(k * dt, dt)
    # A delay L at speed 1 is seen as a speed of 1 + L / dt, and L = 1 / w:
    # 2 pi L (cutoff + beta (1 + L / dt)) = 1.
    rest, bend = cutoff + beta, beta / dt
    L = (np.sqrt(rest**2 + 4 * bend / (2 * np.pi)) - rest) / (2 * bend)
    # After 30 s the start is forgotten.
    assert moving.delay == pytest.approx(L, rel=1e-6)
    assert pytest.approx(0.016, abs=0.0005) == L


def test_fast_signals_are_less_delayed():
    delays = []
    for slope in (0.1, 1.0, 10.0):
        smooth = OneEuro()
        for k in range(1000):
            smooth.step(slope * k * 0.01, 0.01)
        delays.append(smooth.delay)
    assert delays[0] > delays[1] > delays[2]


@given(STEPS)
@example([(0.0, 0.01), (1.0, 0.01), (3.0, 0.01)])
def test_what_falls_is_smoothed_like_what_rises(steps):
    rising, falling = OneEuro(), OneEuro()
    for x, dt in steps:
        # Signs change no rounding.
        np.testing.assert_array_equal(falling.step(-x, dt), -rising.step(x, dt))
        assert falling.delay == rising.delay


def test_after_a_reset_it_starts_anew():
    smooth = OneEuro()
    smooth.step(5.0, 0.01)
    smooth.reset()
    assert smooth.step(1.0, 0.01) == 1.0


@pytest.mark.parametrize(
    "bad", [{"cutoff": 0}, {"beta": -1}, {"speed_cutoff": math.nan}]
)
def test_settings_that_make_no_sense_are_refused(bad):
    with pytest.raises(InvalidInput, match=next(iter(bad))):
        OneEuro(**bad)
