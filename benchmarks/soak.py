"""Run for long: frames lost, memory grown, steps of the clock on the wall.

``ikns stream`` plays a simulated person's recording over LSL at 100 Hz, ``ikns run``
drives a servo that shares no line with the package (``tests/independent_servo``) and
writes a session: three programs, started as a user starts them. With ``--clock-steps``
the wall clock that ``ikns run`` sees is put an hour forward and back (``wall_clock.c``,
which needs a C compiler); the monotonic clock goes on.

    python benchmarks/soak.py [--minutes 30] [--clock-steps] [--quick] [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))

from ending.programs import environment  # noqa: E402
from independent_servo.process import ServoProcess  # noqa: E402
from live import person  # noqa: E402

from ikns.recording.files import write_c3d  # noqa: E402

#: The clock on the wall, in seconds from the truth, one after the other.
_STEPS = (0, 3600, 0, -3600)
#: What a program needs once, such as tables of a library, is there after a minute.
_SETTLED = 60.0


def words(name: str) -> list[str]:
    """Start of a command line."""
    return [sys.executable, str(Path(sys.executable).with_name(name))]


def soak(
    files: Path, seconds: float, *, every: float, clock_steps: bool
) -> dict[str, Any]:
    """Run it, and watch its memory and what it says."""
    seen = environment()
    clock = files / "clock"
    if clock_steps:
        library, source = (
            files / "wall_clock.so",
            Path(__file__).parent / "wall_clock.c",
        )
        flags = ["-O2", "-shared", "-fPIC", "-o", str(library)]
        subprocess.run(["cc", *flags, str(source), "-ldl"], check=True)
        clock.write_text("0")
        seen |= {"LD_PRELOAD": str(library), "WALL_CLOCK": str(clock)}
    with ExitStack() as stack:
        servo = stack.enter_context(ServoProcess(files))
        sender = subprocess.Popen(
            [*words("ikns"), "stream", str(files / "points.c3d")]
            + ["--name", f"soak{os.getpid()}", "--loop"],
            env=environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(sender.wait, 30)
        stack.callback(sender.send_signal, signal.SIGINT)
        running = subprocess.Popen(
            [*words("ikns"), "run", "--subject", str(files / "person")]
            + ["--source", f"lsl:soak{os.getpid()}", "--finger"]
            + [f"dynamixel:{servo.port}", "--session", str(files / "session")]
            + ["--duration", str(seconds), "--json"],
            env=seen,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        stack.callback(running.kill)
        process, memory, steps = psutil.Process(running.pid), [], 0
        while not (files / "session").exists() and running.poll() is None:
            time.sleep(0.1)
        began = time.monotonic()
        while running.poll() is None:
            passed = time.monotonic() - began
            if clock_steps and passed // every > steps:
                steps = int(passed // every)
                clock.write_text(f"{_STEPS[steps % len(_STEPS)]}")
            try:
                memory.append((passed, process.memory_info().rss))
            except psutil.NoSuchProcess:
                break
            time.sleep(1.0)
        said, complained = running.communicate()
        torque = servo["torque_enable"]
    if not said:
        raise RuntimeError(complained)
    report = json.loads(said)  # one report, or this fails
    settled = [size for at, size in memory if _SETTLED < at < seconds]
    first = settled[0] if settled else float("nan")
    rows = subprocess.run(
        [*words("ikns"), "replay", str(files / "session"), "--json"],
        capture_output=True,
        text=True,
        env=environment(),
    )
    return {
        "seconds": report["seconds"],
        "frames": report["frames"],
        "lost": report["source"]["dropped"],
        "rejected": sum(report["rejections"].values()),
        "lost_rows": report["lost_rows"],
        "latency_ms": {
            name: 1e3 * value for name, value in report["latency_s"]["total"].items()
        },
        "memory_mb": first / 1e6,
        "growth_mb": (max(settled, default=first) - first) / 1e6,
        "clock_steps": steps,
        "states": Counter(change["after"] for change in report["transitions"]),
        "said": complained.strip(),
        "exit": running.returncode,
        "replay_exit": rows.returncode,
        "torque_after": torque,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--clock-steps", action="store_true")
    parser.add_argument("--quick", action="store_true", help="ten seconds")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    if given.clock_steps and not shutil.which("cc"):
        parser.error("expected a C compiler, found no cc.")
    seconds = 10.0 if given.quick else 60 * given.minutes
    with tempfile.TemporaryDirectory() as scratch:
        person.make(Path(scratch), 1)
        # Without gaps, or the first long one stops the finger for the rest of the time.
        seen = person.piece(person.load(Path(scratch))[1], 0)
        write_c3d(Path(scratch, "points.c3d"), seen)
        found = soak(
            Path(scratch),
            seconds,
            every=min(30.0, seconds / 8),
            clock_steps=given.clock_steps,
        )
    if given.json:
        print(json.dumps(found))
        return
    print(f"{platform.machine()}, {os.cpu_count()} cores\n\n| | |\n|---|---|")
    for name, value in found.items():
        shown = ", ".join(map(str, value)) if isinstance(value, list) else value
        if isinstance(value, dict):
            shown = ", ".join(f"{k} {v:.4g}" for k, v in value.items())
        print(f"| {name} | {f'{shown:.2f}' if isinstance(shown, float) else shown} |")


if __name__ == "__main__":
    main()
