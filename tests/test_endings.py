"""The benchmark of endings finds what programs do wrong that are made to do it."""

import importlib
import math
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

# Imported by name: the benchmarks are no package of ours.
programs = importlib.import_module("ending.programs")
trials = importlib.import_module("ending.trial")
endings = importlib.import_module("endings")
sys.path.remove(str(ROOT / "benchmarks"))

#: Drives servos at sys.argv[1] with nothing but bytes; `leave` is what it does then.
DRIVES = """
import os, signal, subprocess, sys, termios, time
from independent_servo.packet import packet
fd = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
settings = termios.tcgetattr(fd)
settings[4:6] = [termios.B57600] * 2
termios.tcsetattr(fd, termios.TCSANOW, settings)
def write(address, value, size, ids=[int(word) for word in sys.argv[2:]]):
    body = bytes([3]) + address.to_bytes(2, "little") + value.to_bytes(size, "little")
    for number in ids:
        os.write(fd, packet(2, number, body))
def leave(number, frame):
    {leave}
signal.signal(signal.SIGINT, leave)
write(64, 1, 1)  # torque
write(98, 15, 1)  # the watchdog
for goal in range(2000, 10**6):
    write(116, 2000 + goal % 500, 4)
    time.sleep(0.01)
"""


TWO = "4 ms, two servos"


class Script:
    """Starts a script instead of the command that it is asked for."""

    def __init__(self, leave: str) -> None:
        self._source = DRIVES.replace("{leave}", leave)

    def start(self, argv: list[str], folder: Path) -> Any:
        addresses = [b for a, b in zip(argv, argv[1:], strict=False) if a == "--finger"]
        ports = [re.split("[:?]", address)[1] for address in addresses]
        ids = [address.partition("id=")[2][0] for address in addresses]
        environment = programs.environment()
        environment["PYTHONPATH"] += f":{ROOT / 'tests'}"

        def begin(out: Path, err: Path) -> tuple[int, Callable[[], int | None]]:
            with out.open("wb") as stdout, err.open("ab") as stderr:
                process = subprocess.Popen(
                    [sys.executable, "-c", self._source, ports[0], *ids],
                    stdout=stdout,
                    stderr=stderr,
                    start_new_session=True,
                    env=environment,
                )
            return process.pid, process.poll

        return programs.Program(folder, begin)


def ended(ending: str, leave: str, line: str = "0 ms") -> Any:
    return trials.trial(
        ending,
        "run",
        next(known for known in trials.LINES if known.name == line),
        starter=Script(leave),
        files=Path("nowhere"),
        safe_state="limp",
        rng=np.random.default_rng(1),
        canary=trials.Canary(),
    )


def test_the_time_until_the_torque_is_off_is_measured() -> None:
    result = ended("INT", "time.sleep(0.3); write(64, 0, 1); sys.exit(0)")
    ((what, seconds, stated),) = result.measured
    assert what == "torque off"
    # What the program waits, and at most what the machine is late or starting takes.
    assert 0.3 <= seconds < 1.0
    assert stated < 0.3
    assert result.in_time(0) == (seconds <= stated + result.stall)
    assert (result.exit, result.violations, result.failed) == (0, {}, "")


def test_torque_that_is_left_on_is_never_in_time() -> None:
    result = ended("INT", "os._exit(3)")
    ((_, seconds, _),) = result.measured
    assert math.isnan(seconds)
    assert not result.in_time(0)
    assert (result.exit, result.violations) == (3, {"torque left on": 1})
    (row,) = endings.rows([result])
    assert (row["in_time"], row["n"], row["exit"]) == (0, 1, ["3"])
    assert "| never |" in endings.shown(row)


@pytest.mark.parametrize("left", [1, 2])
def test_torque_that_is_left_on_at_one_of_two_servos_is_found(left: int) -> None:
    result = ended("INT", f"write(64, 0, 1, [{3 - left}]); os._exit(0)", TWO)
    assert not result.in_time(0)
    assert result.violations == {"torque left on": 1}


@pytest.mark.parametrize(
    ("leave", "kind"),
    [
        ("write(36, 100, 2); write(64, 0, 1); sys.exit(0)", "EEPROM under torque"),
        ("write(116, 5000, 4); write(64, 0, 1); sys.exit(0)", "goal beyond limits"),
        ("for on in (0, 1, 0): write(64, on, 1)\n    sys.exit(0)", "torque on again"),
        ("write(64, 0, 1); raise ValueError", "traceback"),
        (
            "write(64, 0, 1); subprocess.Popen(['sleep', '9']); sys.exit(0)",
            "lost process",
        ),
    ],
)
def test_what_must_not_be_is_counted(leave: str, kind: str) -> None:
    assert ended("INT", leave).violations == {kind: 1}


def test_after_a_kill_the_watchdog_is_what_counts() -> None:
    result = ended("KILL", "pass")
    ((what, seconds, stated),) = result.measured
    # 0.3 s after the last goal, of which there is one each 10 ms.
    assert what == "at rest"
    assert 0.28 <= seconds < 1.0
    assert stated == 0.32
    assert result.exit == -signal.SIGKILL


def test_torque_that_stays_on_after_a_stop_is_found() -> None:
    result = ended("STOP 0.5 s", "write(64, 0, 1); sys.exit(0)")
    times = {what: seconds for what, seconds, _ in result.measured}
    assert times["at rest"] < 0.5
    assert math.isnan(times["torque off after CONT"])
    assert times["torque off after INT"] < 1.0
