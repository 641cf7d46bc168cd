"""What a Dynamixel finger does when the wire, the servo or its program fails.

A simulated servo on a pseudo-terminal, the unmodified SDK between it and the finger.
Each fault begins at a random instant of a random movement. Safe means: the finger says
so (where its program still runs), and the servo's own register says that its torque is
off. While nothing reaches the servo only its watchdog can stop it: then safe means
stopped, and the torque goes off, by itself, after the fault. A violation is a goal that
the servo was told out of range or after it was safe, or a step that the finger sent
faster than the limits allow.

    python benchmarks/finger_faults.py [--n 100] [--quick] [--fault NAME ...]
        [--model ax12] [--baud 57600] [--answer-delay 0.004]
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ikns.finger import DynamixelFinger
from ikns.finger.emulator import FAULTS, Servo, Wire

GIVE_UP = 5.0  # s
#: Positions at flexion 0 and 1, ticks: a quarter turn to either side.
RANGE = {"xl430": (1024, 3072), "ax12": (205, 819)}
#: Faults in which nothing reaches the servo.
UNREACHABLE = ("silence", "unplug", "kill -9")
KILLED = """
import sys, time
from ikns.finger import DynamixelFinger
finger = DynamixelFinger(sys.argv[1], model=sys.argv[2], baud=int(sys.argv[3]))
with finger:
    print("ready", flush=True)
    while True:
        finger.command(time.monotonic() % 1)
        time.sleep(0.01)
"""


def safe(servo: Servo, fault: str) -> bool:
    """Whether the torque is off, or the motor stopped where nothing reaches it."""
    return not servo.torque or (fault in UNREACHABLE and servo.watchdog_error)


def wait(condition: Callable[[], bool]) -> float:
    """Seconds until it holds; NaN if it never does."""
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > GIVE_UP:
            return float("nan")
        time.sleep(0.001)
    return time.monotonic() - began


def out_of_range(servo: Servo) -> int:
    """Goals that the servo should not have been told."""
    low, high = RANGE[servo.model.name]
    return sum(not low <= ticks <= high for _, ticks in servo.goals)


class Caller:
    """Commands a finger, and counts steps that were too fast for the time between."""

    def __init__(self, finger: DynamixelFinger) -> None:
        self.finger, self.too_fast = finger, 0
        self._last: tuple[float, float] | None = None

    def __call__(self, flexion: float) -> None:
        """Command once."""
        before = time.monotonic()
        sent = self.finger.command(flexion)
        after = time.monotonic()
        if self._last is not None:
            t, last = self._last
            most = self.finger.safety.limits.rate * (after - t)
            # In whole ticks; NaN, nothing sent, is no step.
            self.too_fast += abs(sent - last) > most + self.finger.resolution
        self._last = before, sent


def trial(
    fault: str, rng: np.random.Generator, link: Path, given: argparse.Namespace
) -> tuple[float, float, int, str]:
    """Seconds until safe and, after the fault, without torque; violations; words."""
    servo = Servo(given.model, baud=given.baud)
    with Wire(servo, link=link, answer_delay=given.answer_delay) as wire:
        if fault == "kill -9":
            return killed(servo, wire, rng)
        finger = DynamixelFinger(wire.port, model=given.model, baud=given.baud)
        finger.connect()
        command = Caller(finger)
        target, end = rng.uniform(), time.monotonic() + rng.uniform(0.02, 0.3)
        while time.monotonic() < end:
            command(target)
            time.sleep(0.01)
        wire.inject(fault)

        def is_safe() -> bool:
            command(1 - target)
            return finger.state().mode == "safe" and safe(servo, fault)

        took = wait(is_safe)
        told = len(servo.goals)
        said = finger.state().alert
        for _ in range(5):
            command(target)
            time.sleep(0.01)
        count = out_of_range(servo) + command.too_fast + len(servo.goals) - told
        wire.clear_faults()
        wait(lambda: wire.plugged)
        off = wait(lambda: not servo.torque)
        count += finger.state().mode != "safe"
        finger.relax()
        if fault == "unplug":
            said = "the port is lost" if "port is lost" in said else said
        return took, off, count, said


def killed(
    servo: Servo, wire: Wire, rng: np.random.Generator
) -> tuple[float, float, int, str]:
    """Kill the program that drives the finger."""
    words = [wire.port, servo.model.name, str(round(servo.baud))]
    command = [sys.executable, "-c", KILLED, *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(rng.uniform(0.02, 0.5))
        process.kill()
        took = wait(lambda: safe(servo, "kill -9"))
    return took, float("nan"), out_of_range(servo), "(nothing)"


def middle(times: np.ndarray) -> str:
    """Write the median of those that came."""
    known = times[np.isfinite(times)]
    return f"{np.median(known):.3f}" if len(known) else "-"


def longest(times: np.ndarray) -> str:
    """Write the longest of those that came."""
    known = times[np.isfinite(times)]
    return f"{known.max():.3f}" if len(known) else "-"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--fault", nargs="*", default=[*FAULTS, "kill -9"])
    parser.add_argument("--model", choices=list(RANGE), default="xl430")
    parser.add_argument("--baud", type=int, default=1_000_000)
    parser.add_argument("--answer-delay", type=float, default=0.0, help="s")
    arguments = parser.parse_args()
    n = 2 if arguments.quick else arguments.n
    print(
        f"{platform.machine()}, {os.cpu_count()} cores, simulated {arguments.model}, "
        f"{arguments.baud} baud, answers after {1e3 * arguments.answer_delay:g} ms, "
        f"{n} each"
    )
    print(
        "| fault | the finger says | safe | p50 s | max s | torque off after it | "
        "max s | violations |"
    )
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for fault in arguments.fault:
            rng = np.random.default_rng([5, *fault.encode()])
            results = [
                trial(fault, rng, Path(folder) / "bus", arguments) for _ in range(n)
            ]
            times, off = np.array([found[:2] for found in results]).T
            said = " / ".join(sorted({said for *_, said in results}))
            print(
                f"| {fault} | {said} | {np.isfinite(times).sum()} of {n} | "
                f"{middle(times)} | {longest(times)} | "
                f"{np.isfinite(off).sum()} of {n} | {longest(off)} | "
                f"{sum(count for *_, count, _ in results)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
