"""What a Dynamixel finger does when the wire, the servo or its program fails.

A simulated servo on a pseudo-terminal, the unmodified SDK between it and the finger.
Each fault begins at a random instant of a random movement. Safe means: the finger says
so (where its program still runs), and the servo has no torque or was stopped by its own
watchdog. A violation is a goal that the servo was told out of range or after it was
safe, or a step that the finger sent faster than the limits allow.

    python benchmarks/finger_faults.py [--n 100] [--quick] [--fault NAME ...]
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

BAUD = 1_000_000
GIVE_UP = 5.0  # s
LOW, HIGH = 1024, 3072  # ticks
KILLED = """
import sys, time
from ikns.finger import DynamixelFinger
with DynamixelFinger(sys.argv[1], baud=1_000_000) as finger:
    print("ready", flush=True)
    while True:
        finger.command(time.monotonic() % 1)
        time.sleep(0.01)
"""


def safe(servo: Servo) -> bool:
    """Whether the servo pushes nobody."""
    return not servo.torque or servo.watchdog_error


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
    return sum(not LOW <= ticks <= HIGH for _, ticks in servo.goals)


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


def trial(fault: str, rng: np.random.Generator, link: Path) -> tuple[float, int, str]:
    """Seconds until safe, violations, and what the finger said."""
    servo = Servo("xl430", baud=BAUD)
    with Wire(servo, link=link) as wire:
        if fault == "kill -9":
            return killed(servo, wire, rng)
        finger = DynamixelFinger(wire.port, baud=BAUD)
        finger.connect()
        command = Caller(finger)
        target, end = rng.uniform(), time.monotonic() + rng.uniform(0.02, 0.3)
        while time.monotonic() < end:
            command(target)
            time.sleep(0.01)
        wire.inject(fault)

        def is_safe() -> bool:
            command(1 - target)
            return finger.state().mode == "safe" and safe(servo)

        took = wait(is_safe)
        told = len(servo.goals)
        said = finger.state().alert
        for _ in range(5):
            command(target)
            time.sleep(0.01)
        count = out_of_range(servo) + command.too_fast + len(servo.goals) - told
        wire.clear_faults()
        wait(lambda: wire.plugged)
        finger.relax()
        if fault == "unplug":
            said = "the port is lost" if "port is lost" in said else said
        return took, count, said


def killed(
    servo: Servo, wire: Wire, rng: np.random.Generator
) -> tuple[float, int, str]:
    """Kill the program that drives the finger."""
    command = [sys.executable, "-c", KILLED, wire.port]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(rng.uniform(0.02, 0.5))
        process.kill()
        took = wait(lambda: safe(servo))
    return took, out_of_range(servo), "(nothing)"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--fault", nargs="*", default=[*FAULTS, "kill -9"])
    arguments = parser.parse_args()
    n = 2 if arguments.quick else arguments.n
    print(f"{platform.machine()}, {os.cpu_count()} cores, simulated xl430, {n} each")
    print("| fault | the finger says | safe | p50 s | max s | violations |")
    print("|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for fault in arguments.fault:
            rng = np.random.default_rng([5, *fault.encode()])
            results = [trial(fault, rng, Path(folder) / "bus") for _ in range(n)]
            times = np.array([took for took, _, _ in results])
            said = " / ".join(sorted({said for _, _, said in results}))
            print(
                f"| {fault} | {said} | {np.isfinite(times).sum()} of {n} | "
                f"{np.nanmedian(times):.3f} | {np.nanmax(times):.3f} | "
                f"{sum(count for _, count, _ in results)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
