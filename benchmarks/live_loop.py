"""Measure how fast, how long and through which faults markers drive a finger.

A simulated person's recording goes through the whole loop: source, pose, control
signal, safety, finger, session. All times are of the monotonic
clock, which processes share.

1. At the cameras' pace, a session being written: from receipt to the finger's command
   in one process, and, side by side with that, from the call that sends a frame over
   LSL in another process. Then 1000 Hz, and 100 Hz beside a thread that computes a
   fifth of the time, as the server of a page does, and beside programs that keep all
   cores busy, without and, where the system allows it, with `--realtime`.
2. At full speed: frames a second, and memory.
3. Faults of source, servo, program and disk, each at random instants: state that the
   loop ends in, time until then against the stated one, commands beyond the limits of
   range, rate and acceleration, and whether the session opens, passes the check and
   replays bit for bit.
4. Programs killed at random instants: seconds lost on disk.
"""

import argparse
import json
import multiprocessing
import os
import platform
import subprocess
import sys
import tempfile
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from live import full_speed, pace, person, process_faults, servo_faults, stream_faults
from live.outcome import LONGEST_STALL, Outcome, Summary, summarize

import ikns
from ikns.errors import InvalidInput
from ikns.live.runtime import check_realtime

PLACES = {"stream": stream_faults, "servo": servo_faults, "program": process_faults}
FAULTS = {
    "stream": stream_faults.STREAM_FAULTS,
    "servo": tuple(servo_faults.SERVO_FAULTS),
    "program": process_faults.PROCESS_FAULTS,
}
TABLES = ("pace", "speed", *PLACES, "kills")


def ready(folder: Path) -> None:
    """Compile or load everything before anything is timed."""
    ikns.warm_up()
    person.load(folder)


def paces(pool: Executor, folder: Path, seconds: float, fast: float) -> dict[str, Any]:
    """At the cameras' pace, with a session."""
    wanted = {
        "in process, 100 Hz": pool.submit(pace.replayed, folder, 100.0, seconds, True),
        "over LSL, 100 Hz": pool.submit(pace.over_lsl, folder, 100.0, seconds, True),
    }
    found = {name: future.result() for name, future in wanted.items()}
    run = pool.submit(pace.replayed, folder, 1000.0, fast, True)
    found["in process, 1000 Hz"] = run.result()
    beside: dict[str, dict[str, Any]] = {
        "a busy thread": {"busy": 0.2},
        "busy programs": {"programs": os.cpu_count()},
    }
    try:
        check_realtime()
        beside["them, in real time"] = beside["busy programs"] | {"realtime": True}
    except InvalidInput as error:
        sys.stderr.write(f"{error}\n")
    for what, load in beside.items():
        run = pool.submit(pace.replayed, folder, 100.0, fast, True, **load)
        found[f"in process, 100 Hz, beside {what}"] = run.result()
    return {name: asdict(one) for name, one in found.items()}


def speeds(pool: Executor, folder: Path, frames: int) -> dict[str, Any]:
    """At full speed, one after the other."""
    found = {}
    for name, count, session in (
        ("no session", frames, False),
        ("with session", max(frames // 10, 100), True),
    ):
        run = pool.submit(full_speed.full_speed, folder, count, session)
        found[name] = asdict(run.result())
    return found


def struck(place: str, name: str, seed: int, folder: Path) -> Outcome:
    """Inject one fault."""
    return PLACES[place].strike(name, seed, folder)


def faults(
    pool: Executor, folder: Path, places: list[str], injections: int, seed: int
) -> list[Summary]:
    """Every fault of some places at instants that the seed sets; without, a few."""
    wanted = [(place, name) for place in places for name in FAULTS[place]]
    wanted, injections = (wanted, injections) if injections else (wanted[::4], 1)
    tries = [
        pool.submit(struck, place, name, seed + 1000 * k + i, folder)
        for k, (place, name) in enumerate(wanted)
        for i in range(injections)
    ]
    return summarize([one.result() for one in tries])


def killed(pool: Executor, folder: Path, kills: int, seed: int) -> dict[str, Any]:
    """Seconds that a session lacks after kill -9."""
    tries = [
        pool.submit(process_faults.kill, "kill -9", seed + 10**6 + i, folder)
        for i in range(kills)
    ]
    found = [one.result() for one in tries]
    lost = [seconds for _, seconds in found]
    wrong = [outcome.session for outcome, _ in found if outcome.session]
    return {
        "kills": kills,
        "lost_p50_s": float(np.median(lost)),
        "lost_max_s": float(max(lost)),
        "sessions": kills - len(wrong),
        "wrong": wrong,
        "validator": validated(seed, folder),
        "motor_still_max_s": max(
            (one.seconds["safe"] for one, _ in found if one.stall <= LONGEST_STALL),
            default=float("nan"),
        ),
    }


def validated(seed: int, folder: Path) -> str:
    """Ask the official validator about a session that was killed and mended."""
    program = Path(sys.executable).with_name("bids-validator-deno")
    if not program.exists():
        return "not installed"
    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session"
        process_faults.kill("kill -9", seed, folder, session=session)
        done = subprocess.run(
            [program, session, "--json"], capture_output=True, text=True, check=False
        )
        issues = json.loads(done.stdout)["issues"]["issues"]
    errors = sum(issue["severity"] == "error" for issue in issues)
    return f"{errors} errors"


def print_paces(rows: dict[str, Any]) -> None:
    """Print table 1."""
    print("\n## At the cameras' pace\n")
    print(
        "| stream | frames | lost | p50 ms | p99 | p99.9 | worst | from when due: p99 "
        "| worst | backlog ms | longer than a frame | held | rows lost |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name, row in rows.items():
        times = " | ".join(f"{t:.2f}" for t in row["milliseconds"].values())
        due = row["from_due"]
        print(
            f"| {name} | {row['frames']} | {row['lost']} | {times} | {due['p99']:.2f} "
            f"| {due['worst']:.2f} | {row['backlog']:+.2f} | {row['misses']} "
            f"| {row['holds']} | {row['lost_rows']} |"
        )


def print_speeds(rows: dict[str, Any]) -> None:
    """Print table 2."""
    print("\n## At full speed\n")
    print("| | frames | frames/s | MB at 10 % | at 50 % | at 100 % | rows lost |")
    print("|---|---|---|---|---|---|---|")
    for name, row in rows.items():
        memory = " | ".join(f"{mb:.1f}" for mb in row["resident"].values())
        print(
            f"| {name} | {row['frames']} | {row['rate']:.0f} | {memory} "
            f"| {row['lost_rows']} |"
        )


def print_faults(rows: list[Summary]) -> None:
    """Print table 3."""
    print("\n## Faults\n")
    print(
        "| fault | injected | ends | as expected | reaction, p50 / longest (stated) ms "
        "| held | limits violated | sessions good |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for row in rows:
        times = ", ".join(
            f"{name} {1e3 * p50:.0f} / {1e3 * most:.0f} ({1e3 * stated:.0f})"
            for name, (p50, most, stated) in row.seconds.items()
        )
        print(
            f"| {row.fault} | {row.injected} | {row.expected} "
            f"| {row.as_expected} of {row.timed} "
            f"| {times or '-'} | {row.held} | {row.violated} "
            f"| {row.sessions} of {row.injected} |"
        )
    total, timed = (sum(getattr(row, n) for row in rows) for n in ("injected", "timed"))
    late = {
        f"{row.fault} ({name})": count
        for row in rows
        for name, count in row.overran.items()
        if count
    }
    print(
        f"\n{total} injections. In {total - timed} the machine kept the loop from "
        f"running for more than {1e3 * LONGEST_STALL:.0f} ms; states and times are of "
        f"the others: {sum(row.as_expected for row in rows)} of {timed} ended as "
        f"expected; reactions later than stated: {late or 'none'}. Of all, "
        f"{sum(row.violated for row in rows)} commands were beyond a limit, and "
        f"{sum(row.sessions for row in rows)} sessions are good."
    )
    for row in rows:
        for text, count in row.remarks.items():
            print(f"{row.fault}: {count} times: {text}")


def print_kills(row: dict[str, Any]) -> None:
    """Print table 4."""
    print("\n## kill -9\n")
    print(
        f"{row['kills']} programs killed at random instants: seconds lost p50 "
        f"{row['lost_p50_s']:.2f}, most {row['lost_max_s']:.2f}; sessions that open, "
        f"and once mended pass the check and replay: {row['sessions']}; one through "
        f"the BIDS validator: {row['validator']}; servo still after at most "
        f"{row['motor_still_max_s']:.3f} s (stated {servo_faults.WATCHDOG:g} s)."
    )
    for text in row["wrong"]:
        print(text)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="some of each")
    parser.add_argument("--minutes", type=float, default=10.0, help="at 100 Hz")
    parser.add_argument("--frames", type=int, default=1_000_000, help="at full speed")
    parser.add_argument("--injections", type=int, default=100, help="of each fault")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=4, help="processes at once")
    parser.add_argument("--only", choices=TABLES, action="append", help="of the tables")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    # One core a process; and what children import once need not be imported again.
    os.environ["OMP_NUM_THREADS"] = "1"
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["ikns.live.runtime", "ikns.calibration"])
    seconds, fast = 60 * options.minutes, 6 * options.minutes
    frames, injections, kills = options.frames, options.injections, options.kills
    if options.quick:
        seconds, fast, frames, injections, kills = 1.0, 0.5, 2000, 0, 1
    only = options.only or TABLES
    start = time.perf_counter()
    loads = [os.getloadavg()[0]]
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        person.make(folder, options.seed, point_seconds=1.0 if options.quick else 2.0)
        with ProcessPoolExecutor(
            options.jobs, mp_context=context, initializer=ready, initargs=(folder,)
        ) as pool:
            if "pace" in only:
                found["pace"] = paces(pool, folder, seconds, fast)
            if "speed" in only:
                found["speed"] = speeds(pool, folder, frames)
            if places := [place for place in PLACES if place in only]:
                found["faults"] = faults(pool, folder, places, injections, options.seed)
            if "kills" in only:
                found["kills"] = killed(pool, folder, kills, options.seed)
    loads.append(os.getloadavg()[0])
    about = {
        "machine": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "load": [round(load, 1) for load in loads],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "ikns": ikns.__version__,
        "seed": options.seed,
        "seconds": round(time.perf_counter() - start),
    }
    if options.json:
        if "faults" in found:
            found["faults"] = [asdict(row) for row in found["faults"]]
        print(json.dumps(about | found, indent=1))
        return
    print(", ".join(f"{key} {value}" for key, value in about.items()) + "; simulated.")
    printers = (print_paces, print_speeds, print_faults, print_kills)
    for table, show in zip(("pace", "speed", "faults", "kills"), printers, strict=True):
        if table in found:
            show(found[table])


if __name__ == "__main__":
    main()
