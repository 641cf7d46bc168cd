"""How long does a person wait for a command? One table of whole processes.

A simulated person's calibration is written as C3D files, and every command runs on it
as a process of its own, from start to exit: a minute of recording for those that read
one, and a few ways to go wrong. Rounds are shuffled. With `--before FOLDER`, a checkout
of another version runs in the same rounds.

At last each version compiles everything into an empty folder, as on first use.
"""

import argparse
import os
import platform
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numba

from ikns.simulation import simulate_protocol, virtual_subject, write_protocol

PROGRAM = "import sys; from ikns.cli import main; sys.exit(main())"
IMPORTS = "import numpy, numba, pinocchio"
COMPILE = "from ikns.live.warm_up import warm_up; warm_up()"
OURS = Path(__file__).parents[1]
#: With --quick; the tests run all commands.
QUICK = (
    "import numpy, numba, pinocchio",
    "--help",
    "ik",
    "run, 0.2 s",
    "a wrong option",
)


class Process(NamedTuple):
    """What a process took."""

    seconds: float
    cpu: float  # s, with what it started and waited for


def commands(folder: Path) -> dict[str, tuple[int, list[str]]]:
    """Exit code and arguments of what is timed; `python` for Python itself."""
    person, static, points, free = (
        str(folder / name)
        for name in ("person", "static.c3d", "points.c3d", "free.c3d")
    )
    motion, new = str(folder / "motion.csv"), str(folder / "new")
    missing = str(folder / "nowhere.c3d")
    source = ["--source", f"replay:{points}", "--finger", "sim:"]
    one = ["--subject", person]
    read = ["--static", static, "--exploration", points]
    return {
        "import numpy, numba, pinocchio": (0, ["python", IMPORTS]),
        "--help": (0, ["--help"]),
        "ik": (0, ["ik", *one, points, "--out", motion, "--force"]),
        "control": (0, ["control", *one, points, "--out", motion, "--force"]),
        "calibrate": (0, ["calibrate", *read, "--out", new, "--force"]),
        "compare": (0, ["compare", *one, "--reaches", free, points]),
        "check": (0, ["check", points, "--static", static]),
        "ucm": (0, ["ucm", *one, points]),
        "run, 0.2 s": (0, ["run", *one, *source, "--duration", "0.2", "--dry-run"]),
        "demo": (0, ["demo", "--out", f"{new}-demo", "--force"]),
        "a wrong option": (2, ["ik", "--nothing"]),
        "ik, no such recording": (2, ["ik", *one, missing]),
        "ik, no such subject": (2, ["ik", "--subject", missing, points]),
        "control, no such recording": (2, ["control", *one, missing]),
        "calibrate, no such file": (
            2,
            ["calibrate", "--static", missing, "--exploration", points, "--out", "x"],
        ),
        "compare, no such recording": (2, ["compare", *one, missing]),
        "run, no such subject": (2, ["run", "--subject", missing, *source]),
        "track, no visit": (2, ["track", *source, *one]),
        "report, no such study": (2, ["report", missing]),
    }


def timed(arguments: list[str], code: int, version: Path, cache: str) -> Process:
    """Run a command of a version's folder; it must end with this exit code."""
    script = [PROGRAM, *arguments]
    if arguments[0] == "python":
        script = arguments[1:]
    environment = os.environ | {
        "PYTHONPATH": str(version),
        "NUMBA_CACHE_DIR": cache,
        "OMP_NUM_THREADS": "1",
    }
    # A user's Python keeps the modules that it has compiled; so does this one, whatever
    # it was told.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    before, began = os.times(), time.perf_counter()
    done = subprocess.run(
        # -P: the folder that this runs in may hold another version.
        [sys.executable, "-P", "-c", *script],
        env=environment,
        capture_output=True,
        text=True,
    )
    seconds, after = time.perf_counter() - began, os.times()
    if done.returncode != code:
        raise RuntimeError(f"{' '.join(arguments)}: {done.stderr or done.stdout}")
    used = (after.children_user + after.children_system) - (
        before.children_user + before.children_system
    )
    return Process(seconds, used)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="short files, few commands, one round"
    )
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--before", type=Path, help="checkout of another version")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rounds = 1 if options.quick else options.rounds
    versions = [OURS] if options.before is None else [options.before.resolve(), OURS]
    short = {"point_seconds": 2.0, "rate": 50.0} if options.quick else {}
    protocol = simulate_protocol(
        virtual_subject(options.seed), seed=options.seed, **short
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_protocol(folder, protocol)
        caches = [str(folder / f"kernels{k}") for k in range(len(versions))]
        if options.quick and (kept := os.environ.get("NUMBA_CACHE_DIR")):
            caches = [kept] * len(versions)
        first = [
            timed(["python", COMPILE], 0, *at)
            for at in zip(versions, caches, strict=True)
        ]
        loaded = ("warm_up, all compiled before", (0, ["python", COMPILE]))
        steps = dict([loaded]) | commands(folder)
        if options.quick:
            steps = {name: steps[name] for name in QUICK}
        made = ["calibrate", "--static", f"{folder}/static.c3d", "--exploration"]
        made += [f"{folder}/points.c3d", "--out", f"{folder}/person"]
        timed(made, 0, OURS, caches[-1])
        found: dict[tuple[str, int], list[Process]] = {}
        draw = random.Random(options.seed)
        # The first round also makes Python's own files, and does not count.
        for turn in range(rounds + 1 - options.quick):
            order = [(step, k) for step in steps for k in range(len(versions))]
            draw.shuffle(order)
            for step, k in order:
                code, words = steps[step]
                took = timed(words, code, versions[k], caches[k])
                if turn or options.quick:
                    found.setdefault((step, k), []).append(took)
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python "
        f"{platform.python_version()}, numba {numba.__version__}, seed {options.seed}, "
        f"load {os.getloadavg()[2]:.0f}; simulated, "
        f"{len(protocol.points.recording.time)} frames; median of {rounds}"
    )
    names = ["before", "now"][-len(versions) :]
    heads = [f"{name}, {unit}" for name in names for unit in ("s", "CPU s")]
    print("| process | " + " | ".join(heads) + " |")
    print("| --- " * (len(heads) + 1) + "|")
    row = [f"{x:.2f}" for took in first for x in took]
    label = "warm_up" if options.quick else "warm_up, nothing compiled"
    print(f"| {label} | " + " | ".join(row) + " |")
    for step in steps:
        row = []
        for k in range(len(versions)):
            took = found[step, k]
            row += [f"{median(each.seconds for each in took):.2f}"]
            row += [f"{median(each.cpu for each in took):.2f}"]
        print(f"| {step} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
