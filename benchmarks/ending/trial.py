"""One ending of one program, and what the servo makes of it."""

from __future__ import annotations

import math
import os
import signal
import tempfile
import termios
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from independent_servo.process import ServoProcess

from ending.programs import Pages, Program, argv_of

__all__ = ["ENDINGS", "LINES", "Canary", "Line", "Result", "trial"]


class Line(NamedTuple):
    """How slow the line to the servo is; ids of the servos of each port."""

    name: str
    answer_delay: float  # s
    byte_time: bool
    ports: tuple[tuple[int, ...], ...] = ((1,),)

    @property
    def exchange(self) -> float:
        """Seconds of the longest question and answer: 14 bytes there, 46 back.

        Servos of one port take turns.
        """
        wire = 60 * 10 / _BAUD if self.byte_time else 0.0
        one = self.answer_delay + wire + 0.0005  # return delay
        return one * max(map(len, self.ports))


_BAUD = 57600
LINES = (
    *(Line(f"{ms} ms", ms / 1000, False) for ms in (0, 2, 4, 10)),
    Line("57600 baud", 0.0, True),
    Line("4 ms, two servos", 0.004, False, ((1, 2),)),
    Line("4 ms, two ports", 0.004, False, ((1,), (1,))),
)
#: Stated (SAFETY.md): one look and a few packets; the servo's own watchdog; a loop that
#: hangs is made safe by the finger itself. Packets take longer on a slow line, and the
#: finger may be in the middle of a few.
_LOOK, _PACKETS, _FEW = 0.02, 0.08, 8
_WATCHDOG, _HANG = 0.32, 0.5
#: How long a program may take to begin, to end (it writes its files once the finger is
#: relaxed), and the servo to come to rest, s.
_BEGIN, _END, _REST = 120.0, 30.0, 2.0
_TERMINAL = {signal.SIGINT, signal.SIGHUP, signal.SIGQUIT}  # go to the whole group
_LIVES_ON = {0, signal.SIGSTOP}  # a program that must be ended after that
ENDINGS = {
    "INT": (signal.SIGINT, math.nan),
    "TERM": (signal.SIGTERM, math.nan),
    "HUP": (signal.SIGHUP, math.nan),
    "QUIT": (signal.SIGQUIT, math.nan),
    "INT 3 times": (signal.SIGINT, math.nan),
    "stdout closed, INT": (signal.SIGINT, math.nan),
    "KILL": (signal.SIGKILL, math.nan),
    "STOP 0.5 s": (signal.SIGSTOP, 0.5),
    "STOP 5 s": (signal.SIGSTOP, 5.0),
    "port taken 1 s": (0, 1.0),
}


@dataclass
class Result:
    """What one trial came to.

    Parameters
    ----------
    ending, command, line : str
    measured : list of (str, float, float)
        What was waited for, how long it took (NaN if it never came), and what is
        stated, s.
    exit : int or None
        Code; None where the program had to be killed.
    violations : dict of int
        By kind.
    stall : float
        Longest that this machine kept the benchmark itself waiting, s.
    said, failed : str
        The program's last line on stderr, and why it never moved the finger.
    """

    ending: str
    command: str
    line: str
    measured: list[tuple[str, float, float]] = field(default_factory=list)
    exit: int | None = None
    violations: dict[str, int] = field(default_factory=dict)
    stall: float = 0.0
    said: str = ""
    failed: str = ""

    def in_time(self, at: int) -> bool:
        """Whether a measured time is as stated, the machine's own delay granted."""
        _, seconds, stated = self.measured[at]
        return seconds <= stated + self.stall


class Canary:
    """Measures how late this machine wakes a thread that sleeps."""

    def __init__(self) -> None:
        self._late: deque[tuple[float, float]] = deque(maxlen=100_000)
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            due = time.monotonic() + 0.005
            time.sleep(0.005)
            now = time.monotonic()
            if now - due > 0.005:
                self._late.append((now, now - due))

    def worst(self, since: float) -> float:
        """Longest delay since a time, s."""
        return max((late for now, late in tuple(self._late) if now >= since), default=0)


def trial(
    ending: str,
    command: str,
    line: Line,
    *,
    starter: Any,
    files: Path,
    safe_state: str,
    rng: np.random.Generator,
    canary: Canary,
) -> Result:
    """Start a program, end it at a random instant, and ask the servo."""
    result = Result(ending, command, line.name)
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        folder = Path(scratch)
        servos, words = _start(line, folder, stack)
        program = starter.start(
            argv_of(command, files, folder, words, safe_state), folder
        )
        pages = Pages(command, program) if command != "run" else None
        try:
            if not _moves(servos, program, pages):
                result.failed = program.said().strip()[-300:] or "never moved"
                return result
            time.sleep(rng.uniform(0.05, 1.0))
            began = time.monotonic()
            _end(ending, program, servos, line, safe_state, result)
            result.stall = canary.worst(began)
            result.exit = program.poll()
            for servo in servos:
                _judge(servo, ending, began, safe_state, result)
            _judge_program(program, result)
        finally:
            if pages is not None:
                pages.close()
            program.end()
    return result


def _start(line: Line, folder: Path, stack: ExitStack) -> tuple[list[Any], list[str]]:
    """Start the servos of a line; return them, and each as PORT?id=1."""
    servos: list[Any] = []
    words = []
    for k, ids in enumerate(line.ports):
        place = folder / f"port{k}"
        place.mkdir()
        process = ServoProcess(
            place,
            id=ids,
            baud=_BAUD,
            answer_delay=line.answer_delay,
            byte_time=line.byte_time,
        )
        stack.enter_context(process)
        servos += [process.servo(number) for number in ids]
        words += [f"{process.port}?id={number}" for number in ids]
    return servos, words


def _wait(condition: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def _moves(servos: list[Any], program: Program, pages: Pages | None) -> bool:
    """Wait until the program has moved the servos under torque for a while."""

    def moving() -> bool:
        goals = [
            {e["goal"] for e in servo.events("goal") if e["torque"]} for servo in servos
        ]
        ready = pages is None or pages.running.is_set()
        moved = min(map(len, goals)) > 5
        return (moved and ready) or program.poll() is not None

    return _wait(moving, _BEGIN) and program.poll() is None


def _end(
    ending: str,
    program: Program,
    servos: list[Any],
    line: Line,
    safe_state: str,
    result: Result,
) -> None:
    """End it in one of the ways; measure what is stated for this one."""
    number, pause = ENDINGS[ending]
    leave = _LOOK + _PACKETS + _FEW * line.exchange
    if ending == "stdout closed, INT":
        program.close_stdout()
        time.sleep(0.2)
    struck = time.monotonic()
    if ending == "port taken 1 s":
        _take_port(servos[0].port, pause)
        result.measured.append(("at rest", _at_rest(servos, struck), _WATCHDOG))
    else:
        program.send(number, group=number in _TERMINAL)
    if ending == "INT 3 times":
        for _ in range(2):
            time.sleep(0.05)
            program.send(number, group=True)
    if number == signal.SIGKILL:
        _wait(lambda: not math.isnan(_at_rest(servos, struck)), _REST)
        result.measured.append(("at rest", _at_rest(servos, struck), _WATCHDOG))
        _wait(lambda: program.poll() is not None, _END)
        return
    if number == signal.SIGSTOP:
        time.sleep(pause)
        result.measured.append(("at rest", _at_rest(servos, struck), _WATCHDOG))
        struck = time.monotonic()
        program.send(signal.SIGCONT, group=False)
        stated = _HANG + _LOOK + _FEW * line.exchange
        time.sleep(stated + 1.0)
        if safe_state == "limp":
            result.measured.append(
                ("torque off after CONT", _torque_off(servos, struck), stated)
            )
        elif any(_follows(servo, safe_state, struck + stated) for servo in servos):
            result.violations["follows after CONT"] = 1
    if number in _LIVES_ON:
        struck = time.monotonic()
        program.send(signal.SIGINT, group=True)
    _wait(lambda: program.poll() is not None, _END)
    _wait(lambda: not math.isnan(_torque_off(servos, struck)), _REST)
    what = "torque off" if number not in _LIVES_ON else "torque off after INT"
    result.measured.append((what, _torque_off(servos, struck), leave))


def _take_port(port: Path, seconds: float) -> None:
    """Open the port at another rate, as a second program would, and close it."""
    fd = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        settings = termios.tcgetattr(fd)
        settings[4:6] = [termios.B1000000] * 2
        termios.tcsetattr(fd, termios.TCSANOW, settings)
        time.sleep(seconds)
    finally:
        os.close(fd)


def _torque_off(servos: list[Any], since: float) -> float:
    """Seconds until every torque went off for good; NaN while one is on."""
    if any(servo["torque_enable"] for servo in servos):
        return math.nan
    off = [
        [e["t"] for e in servo.events("torque") if not e["on"]][-1] for servo in servos
    ]
    return max(max(off) - since, 0.0)


def _at_rest(servos: list[Any], since: float) -> float:
    """Seconds until every motor was stopped, by the watchdog or without torque."""
    times = []
    for servo in servos:
        events = [e for e in servo.events() if e["event"] in ("torque", "watchdog")]
        stops = [e["t"] for e in events if e.get("tripped") == 1 or e.get("on") == 0]
        times.append(next((t - since for t in stops if t >= since), math.nan))
    return math.nan if any(t != t for t in times) else max(*times, 0.0)


def _follows(servo: Any, safe_state: str, since: float) -> bool:
    """Whether goals still do more than hold, or open, to a few ticks."""
    goals = [e["goal"] for e in servo.events("goal") if e["t"] > since]
    if safe_state == "hold":
        return bool(goals) and max(goals) - min(goals) > 8
    return any(b > a + 8 for a, b in zip(goals, goals[1:], strict=False))


def _judge(
    servo: Any, ending: str, began: float, safe_state: str, result: Result
) -> None:
    """Count what must not be at a servo."""
    events, wrong = servo.events(), dict[str, int]()
    number = ENDINGS[ending][0]
    stopped = servo["bus_watchdog"] == -1
    goals = [e for e in events if e["event"] == "goal"]
    low_high = [(e["goal"], *e["limits"]) for e in goals]
    wrong["goal beyond limits"] = sum(not lo <= g <= hi for g, lo, hi in low_high)
    eeprom = [e for e in events if e["event"] == "eeprom"]
    wrong["EEPROM under torque"] = sum(e["torque"] for e in eeprom)
    if number != signal.SIGKILL and result.exit is not None:
        wrong["torque left on"] = servo["torque_enable"]
        wrong["not at rest"] = int(bool(servo["torque_enable"]) and not stopped)
    if (
        safe_state == "limp" or number not in _LIVES_ON
    ):  # else it is taken up again, to hold
        on = [e for e in events if e["event"] == "torque" and e["on"]]
        wrong["torque on again"] = sum(e["t"] > began for e in on)
    _count(wrong, result)


def _judge_program(program: Program, result: Result) -> None:
    """Count what must not be of the program, and end what is left."""
    result.said = program.said().strip().rpartition("\n")[2]
    wrong = {
        "traceback": program.said().count("Traceback (most recent"),
        "does not end": int(result.exit is None),
    }
    if result.exit is not None:
        _wait(lambda: not program.left_over(), 1.0)
        wrong["lost process"] = len(program.left_over())
    _count(wrong, result)


def _count(wrong: dict[str, int], result: Result) -> None:
    for name, count in wrong.items():
        if count:
            result.violations[name] = result.violations.get(name, 0) + count
