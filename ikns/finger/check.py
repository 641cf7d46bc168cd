"""Does a finger keep the laws of the house? A test for any implementation."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields

from ikns.finger.errors import FingerError
from ikns.finger.guard import Safety
from ikns.finger.state import MODES, Finger, FingerState

__all__ = ["LAWS", "FingerReport", "check_finger"]

#: No call of a control loop may take longer, seconds: one that waited for a device's
#: time-outs would.
_NEVER_BLOCKS = 0.25
_PERIOD = 0.01
#: Share by which a clock that is read inside and outside may differ, and seconds.
_JITTER, _LATE = 0.05, 0.05


@dataclass(frozen=True)
class FingerReport:
    """Which laws a finger keeps.

    Parameters
    ----------
    kept : tuple of str
    broken : dict of str
        What happened instead, by law.
    """

    kept: tuple[str, ...]
    broken: dict[str, str]


class _Bench:
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
        return getattr(self.make(), "safety", Safety())

    def stream(
        self, finger: Finger, flexion: float, duration: float
    ) -> list[tuple[float, float]]:
        """Command again and again: (time, sent)."""
        end = self.clock() + duration
        sent = []
        while self.clock() < end:
            self.sleep(_PERIOD)
            value = finger.command(flexion)
            sent.append((self.clock(), value))
        return sent


def _holds(condition: bool, otherwise: str) -> None:
    if not condition:
        raise _Broken(otherwise)


class _Broken(Exception):
    pass


def _nothing_before_connecting(bench: _Bench) -> None:
    finger = bench.make()
    sent = finger.command(0.5)
    _holds(math.isnan(sent), f"command sent {sent}")
    mode = finger.state().mode
    _holds(mode == "relaxed", f"its mode is {mode}")


def _starts_softly(bench: _Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        start = min(max(finger.state().flexion, limits.lower), limits.upper)
        began = bench.clock()
        bench.sleep(_PERIOD)
        sent = finger.command(1.0 - round(start))
        passed = bench.clock() - began
        reach = limits.rate * min(passed + _LATE, limits.longest_step)
        reach += finger.resolution + bench.safety.stall_tolerance
        _holds(abs(sent - start) <= reach, f"from {start:.3f} it jumped to {sent:.3f}")


def _stays_in_range(bench: _Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        for asked in (7.0, -7.0):
            for _, sent in bench.stream(finger, asked, 0.15):
                inside = limits.lower <= sent <= limits.upper
                _holds(inside, f"asked for {asked}, it sent {sent}")


def _keeps_the_rate(bench: _Bench) -> None:
    limits = bench.safety.limits
    with bench.make() as finger:
        before = bench.clock()
        values = [(before, finger.command(math.nan))]
        for asked in (1.0, 0.0, 1.0):
            values += bench.stream(finger, asked, 0.12)
    for (t0, y0), (t1, y1) in zip(values, values[1:], strict=False):
        most = limits.rate * (t1 - t0) * (1 + _JITTER) + finger.resolution
        most += limits.rate * _LATE  # two readings of a clock on a busy machine
        _holds(abs(y1 - y0) <= most, f"{abs(y1 - y0):.3f} in {t1 - t0:.4f} s")


def _holds_without_a_number(bench: _Bench) -> None:
    limits = bench.safety.limits
    braking = limits.rate**2 / (2 * limits.acceleration)
    with bench.make() as finger:
        moving = bench.stream(finger, 0.5, 0.2)[-1][1]
        for asked in (math.nan, math.inf, -math.inf):
            values = bench.stream(finger, asked, 0.1)
            far = max(abs(sent - moving) for _, sent in values)
            most = braking + finger.resolution + limits.rate * _LATE
            _holds(far <= most, f"asked for {asked}, it moved by {far:.3f}")


def _follows(bench: _Bench) -> None:
    limits = bench.safety.limits
    middle = (limits.lower + limits.upper) / 2
    enough = 1.0 / limits.rate + 2 * limits.rate / limits.acceleration + 0.3
    with bench.make() as finger:
        sent = bench.stream(finger, middle, enough)[-1][1]
        _holds(abs(sent - middle) <= finger.resolution, f"asked {middle}, sent {sent}")
        measured = finger.state().flexion
        near = abs(measured - middle) <= bench.safety.stall_tolerance
        _holds(near, f"asked {middle}, measured {measured:.3f}")


def _tells_its_state(bench: _Bench) -> None:
    with bench.make() as finger:
        bench.stream(finger, 0.3, 0.1)
        first = finger.state()
        bench.stream(finger, 0.3, 0.1)
        state = finger.state()
        _holds(isinstance(state, FingerState), f"state is {type(state).__name__}")
        _holds(state.mode == "active", f"its mode is {state.mode} ({state.alert})")
        _holds(state.mode in MODES, f"its mode is {state.mode}")
        _holds(math.isfinite(state.flexion), "it does not know its flexion")
        _holds(state.time >= first.time, "its time went backwards")
        _holds(0 <= state.age < _NEVER_BLOCKS, f"its state is {state.age} s old")
        for field in fields(FingerState):
            value = getattr(state, field.name)
            _holds(value is not None, f"{field.name} is None instead of NaN")


def _never_blocks(bench: _Bench) -> None:
    with bench.make() as finger:
        longest = 0.0
        for _ in range(20):
            bench.sleep(_PERIOD)
            began = time.monotonic()
            finger.command(0.5)
            finger.state()
            longest = max(longest, time.monotonic() - began)
    _holds(longest < _NEVER_BLOCKS, f"a call took {longest:.3f} s")


def _notices_silence(bench: _Bench) -> None:
    timeout = bench.safety.command_timeout
    with bench.make() as finger:
        finger.command(0.5)
        bench.sleep(timeout + _NEVER_BLOCKS)
        state = finger.state()
        _holds(state.mode == "safe", f"its mode is {state.mode} after {timeout} s")
        _holds(bool(state.alert), "it does not say why")


def _stays_safe_until_connected(bench: _Bench) -> None:
    with bench.make() as finger:
        bench.stream(finger, 0.5, 0.2)
        finger.make_safe("a test")
        values = [sent for _, sent in bench.stream(finger, 1.0, 0.3)]
        moved = values[-1] > values[0] + finger.resolution + 0.2
        _holds(not moved, "it went on following")
        _holds(finger.state().mode == "safe", f"its mode is {finger.state().mode}")
        _holds(finger.state().alert == "a test", f"it says '{finger.state().alert}'")
        finger.connect()
        mode = finger.state().mode
        _holds(mode == "active", f"connected again, its mode is {mode}")


def _relaxes(bench: _Bench) -> None:
    finger = bench.make()
    finger.connect()
    bench.stream(finger, 0.5, 0.05)
    for _ in range(2):
        finger.relax()
        state = finger.state()
        _holds(state.mode == "relaxed", f"its mode is {state.mode}")
        _holds(math.isnan(finger.command(1.0)), "relaxed, it followed a command")


def _relaxes_after_an_exception(bench: _Bench) -> None:
    finger = bench.make()
    passed = False
    try:
        with finger:
            bench.stream(finger, 0.5, 0.05)
            raise _Broken
    except _Broken:
        passed = True
    _holds(passed, "it swallowed the exception")
    _holds(finger.state().mode == "relaxed", f"its mode is {finger.state().mode}")


def _connects_again(bench: _Bench) -> None:
    finger = bench.make()
    for _ in range(2):
        with finger:
            bench.stream(finger, 0.5, 0.05)
            mode = finger.state().mode
            _holds(mode == "active", f"its mode is {mode}")


_LAWS: dict[str, Callable[[_Bench], None]] = {
    "sends nothing before it is connected": _nothing_before_connecting,
    "starts softly from where it is": _starts_softly,
    "stays in its range": _stays_in_range,
    "keeps to its rate": _keeps_the_rate,
    "holds when asked for no number": _holds_without_a_number,
    "gets where it is told": _follows,
    "tells its state": _tells_its_state,
    "never blocks": _never_blocks,
    "notices that nobody commands it": _notices_silence,
    "stays safe until connected again": _stays_safe_until_connected,
    "relaxes, and again": _relaxes,
    "relaxes after an exception": _relaxes_after_an_exception,
    "connects again": _connects_again,
}
#: What :func:`check_finger` tests, by name.
LAWS: tuple[str, ...] = tuple(_LAWS)


def check_finger(
    make_finger: Callable[[], Finger],
    *,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    strict: bool = True,
) -> FingerReport:
    """Test that a finger does what :class:`Finger` promises.

    The finger moves: nothing may be in its way, and nobody may wear it.

    Parameters
    ----------
    make_finger : callable
        Returns a new finger, not connected; one is made for every law.
    clock, sleep : callable
        The finger's time, where it is not the real one.
    strict : bool
        Whether to raise at the end if a law is broken.

    Returns
    -------
    FingerReport

    Raises
    ------
    FingerError
        When a law is broken; it names all that are.

    Examples
    --------
    >>> from ikns.finger import SimulatedFinger
    >>> now = 0.0
    >>> def sleep(duration):
    ...     global now
    ...     now += duration
    >>> def make():
    ...     return SimulatedFinger(clock=lambda: now)
    >>> len(check_finger(make, clock=lambda: now, sleep=sleep).kept)
    13
    """
    bench = _Bench(make_finger, clock, sleep)
    kept: list[str] = []
    broken: dict[str, str] = {}
    for law, test in _LAWS.items():
        with _noting(law, kept, broken):
            test(bench)
    if strict and broken:
        raise FingerError(
            "the finger breaks a law: "
            + "; ".join(f"{law} ({what})" for law, what in broken.items())
            + "."
        )
    return FingerReport(tuple(kept), broken)


@contextmanager
def _noting(law: str, kept: list[str], broken: dict[str, str]) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        what = str(error).rstrip(".") or repr(error)
        broken[law] = what if isinstance(error, _Broken) else f"raised {what}"
    else:
        kept.append(law)
