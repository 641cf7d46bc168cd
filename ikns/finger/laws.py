"""The laws of :class:`ikns.finger.Finger`, each one a test that moves a finger."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import fields

from ikns.finger.guard import Safety
from ikns.finger.state import MODES, Finger, FingerState

#: Longest that a call of the control loop may take, s; one that waited for a device's
#: timeout would take longer.
_NEVER_BLOCKS = 0.25
_PERIOD = 0.01
#: By how much the finger's and the caller's readings of a clock may differ: a share of
#: the step, and seconds.
_JITTER, _LATE = 0.05, 0.05


class LawBroken(Exception):
    """A finger broke a law; the message says what happened instead."""


class Bench:
    """Makes fingers and lets their time pass.

    Parameters
    ----------
    make_finger : callable
        Returns a new finger, not connected.
    clock, sleep : callable
        The finger's time.
    """

    def __init__(
        self,
        make_finger: Callable[[], Finger],
        clock: Callable[[], float],
        sleep: Callable[[float], None],
    ) -> None:
        self.make = make_finger
        self.clock, self.sleep = clock, sleep

    @property
    def safety(self) -> Safety:
        """Settings of the finger under test."""
        return getattr(self.make(), "safety", Safety())

    def stream(
        self, finger: Finger, flexion: float, duration: float
    ) -> list[tuple[float, float]]:
        """Command every 10 ms; return pairs of time and flexion sent."""
        end = self.clock() + duration
        sent = []
        while self.clock() < end:
            self.sleep(_PERIOD)
            value = finger.command(flexion)
            sent.append((self.clock(), value))
        return sent


def _require(condition: bool, otherwise: str) -> None:
    if not condition:
        raise LawBroken(otherwise)


def _nothing_before_connecting(bench: Bench) -> None:
    finger = bench.make()
    sent = finger.command(0.5)
    _require(math.isnan(sent), f"command sent {sent}")
    mode = finger.state().mode
    _require(mode == "relaxed", f"its mode is {mode}")


def _starts_softly(bench: Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        start = min(max(finger.state().flexion, limits.lower), limits.upper)
        began = bench.clock()
        bench.sleep(_PERIOD)
        sent = finger.command(1.0 - round(start))
        passed = bench.clock() - began
        reach = limits.rate * min(passed + _LATE, limits.longest_step)
        reach += finger.resolution + bench.safety.stall_tolerance
        _require(
            abs(sent - start) <= reach, f"from {start:.3f} it jumped to {sent:.3f}"
        )


def _stays_in_range(bench: Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        for asked in (7.0, -7.0):
            for _, sent in bench.stream(finger, asked, 0.15):
                inside = limits.lower <= sent <= limits.upper
                _require(inside, f"asked for {asked}, it sent {sent}")


def _keeps_the_rate(bench: Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        before = bench.clock()
        values = [(before, finger.command(math.nan))]
        for asked in (1.0, 0.0, 1.0):
            values += bench.stream(finger, asked, 0.12)
    for (t0, y0), (t1, y1) in zip(values, values[1:], strict=False):
        most = limits.rate * (t1 - t0) * (1 + _JITTER) + finger.resolution
        most += limits.rate * _LATE  # two readings of a clock on a busy machine
        _require(abs(y1 - y0) <= most, f"{abs(y1 - y0):.3f} in {t1 - t0:.4f} s")


def _holds_without_a_target(bench: Bench) -> None:
    limits = bench.safety.limits
    braking = limits.rate**2 / (2 * limits.acceleration)
    with bench.make() as finger:
        moving = bench.stream(finger, 0.5, 0.2)[-1][1]
        for asked in (math.nan, math.inf, -math.inf):
            values = bench.stream(finger, asked, 0.1)
            far = max(abs(sent - moving) for _, sent in values)
            most = braking + finger.resolution + limits.rate * _LATE
            _require(far <= most, f"asked for {asked}, it moved by {far:.3f}")


def _follows(bench: Bench) -> None:
    limits = bench.safety.limits
    middle = (limits.lower + limits.upper) / 2
    enough = 1.0 / limits.rate + 2 * limits.rate / limits.acceleration + 0.3
    with bench.make() as finger:
        sent = bench.stream(finger, middle, enough)[-1][1]
        _require(
            abs(sent - middle) <= finger.resolution, f"asked {middle}, sent {sent}"
        )
        measured = finger.state().flexion
        near = abs(measured - middle) <= bench.safety.stall_tolerance
        _require(near, f"asked {middle}, measured {measured:.3f}")


def _reports_its_state(bench: Bench) -> None:
    with bench.make() as finger:
        bench.stream(finger, 0.3, 0.1)
        first = finger.state()
        bench.stream(finger, 0.3, 0.1)
        state = finger.state()
        _require(isinstance(state, FingerState), f"state is {type(state).__name__}")
        _require(state.mode == "active", f"its mode is {state.mode} ({state.alert})")
        _require(state.mode in MODES, f"its mode is {state.mode}")
        _require(math.isfinite(state.flexion), "its flexion is not finite")
        _require(state.time >= first.time, "its time went backwards")
        _require(0 <= state.age < _NEVER_BLOCKS, f"its state is {state.age} s old")
        for field in fields(FingerState):
            value = getattr(state, field.name)
            _require(value is not None, f"{field.name} is None instead of NaN")


def _never_blocks(bench: Bench) -> None:
    with bench.make() as finger:
        longest = 0.0
        for _ in range(20):
            bench.sleep(_PERIOD)
            began = time.monotonic()
            finger.command(0.5)
            finger.state()
            longest = max(longest, time.monotonic() - began)
    _require(longest < _NEVER_BLOCKS, f"a call took {longest:.3f} s")


def _notices_silence(bench: Bench) -> None:
    timeout = bench.safety.command_timeout
    with bench.make() as finger:
        finger.command(0.5)
        bench.sleep(timeout + _NEVER_BLOCKS)
        state = finger.state()
        _require(state.mode == "safe", f"its mode is {state.mode} after {timeout} s")
        _require(bool(state.alert), "it does not say why")


def _stays_safe_until_connected(bench: Bench) -> None:
    with bench.make() as finger:
        bench.stream(finger, 0.5, 0.2)
        finger.make_safe("a test")
        values = [sent for _, sent in bench.stream(finger, 1.0, 0.3)]
        moved = values[-1] > values[0] + finger.resolution + 0.2
        _require(not moved, "it kept following commands")
        _require(finger.state().mode == "safe", f"its mode is {finger.state().mode}")
        _require(finger.state().alert == "a test", f"it says '{finger.state().alert}'")
        finger.connect()
        mode = finger.state().mode
        _require(mode == "active", f"connected again, its mode is {mode}")


def _relaxes(bench: Bench) -> None:
    finger = bench.make()
    finger.connect()
    bench.stream(finger, 0.5, 0.05)
    for _ in range(2):
        finger.relax()
        state = finger.state()
        _require(state.mode == "relaxed", f"its mode is {state.mode}")
        _require(math.isnan(finger.command(1.0)), "relaxed, it followed a command")


def _relaxes_after_an_exception(bench: Bench) -> None:
    finger = bench.make()
    passed = False
    try:
        with finger:
            bench.stream(finger, 0.5, 0.05)
            raise LawBroken
    except LawBroken:
        passed = True
    _require(passed, "it swallowed the exception")
    _require(finger.state().mode == "relaxed", f"its mode is {finger.state().mode}")


def _connects_again(bench: Bench) -> None:
    finger = bench.make()
    for _ in range(2):
        with finger:
            bench.stream(finger, 0.5, 0.05)
            mode = finger.state().mode
            _require(mode == "active", f"its mode is {mode}")


#: Tests by the law that each one checks; a test raises `LawBroken`.
LAWS: dict[str, Callable[[Bench], None]] = {
    "sends nothing before it is connected": _nothing_before_connecting,
    "starts softly from where it is": _starts_softly,
    "stays in its range": _stays_in_range,
    "keeps to its rate": _keeps_the_rate,
    "holds when the command is not finite": _holds_without_a_target,
    "reaches its target": _follows,
    "reports its state": _reports_its_state,
    "never blocks": _never_blocks,
    "notices that commands stop": _notices_silence,
    "stays safe until connected again": _stays_safe_until_connected,
    "relaxes, also when repeated": _relaxes,
    "relaxes after an exception": _relaxes_after_an_exception,
    "connects again": _connects_again,
}
