"""How long a servo keeps its torque when the program that drives it is ended.

``ikns run``, ``track`` and ``pick`` are started as a user starts them, on a servo that
shares no line with the package (``tests/independent_servo``) and runs in a process of
its own. At a random instant of a movement the program is ended; what is reported is
read from the servo, never from the program.

    python benchmarks/endings.py [--n 2] [--quick] [--jobs 2] [--cold] [--json]
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import platform
import signal
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))

from ending.programs import COMMANDS, ForkServer, Shell  # noqa: E402
from ending.trial import ENDINGS, LINES, Canary, Result, trial  # noqa: E402

QUICK = ("HUP", "STOP 0.5 s")


def person(folder: Path) -> None:
    """Simulate a person and a recording to play, unless they are there."""
    if (folder / "two").exists():
        return
    import small_person

    folder.mkdir(parents=True, exist_ok=True)
    free = small_person.protocol().free.recording
    small_person.write(folder, "free", free)
    small_person.subject().save(folder / "person")
    small_person.two_freedoms().save(folder / "two")


def rows(results: list[Result]) -> list[dict]:
    """Make a row for each thing measured of an ending, command and line."""
    found = []
    for _, group in itertools.groupby(results, lambda r: (r.ending, r.command, r.line)):
        same = list(group)
        good = [r for r in same if not r.failed]
        names = dict.fromkeys(what for r in good for what, *_ in r.measured)
        kinds = dict.fromkeys(kind for r in good for kind in r.violations)
        for place, what in enumerate(names or [""]):
            seconds = [r.measured[place][1] for r in good]
            row = {
                "ending": same[0].ending,
                "command": same[0].command,
                "line": same[0].line,
                "measured": what,
                "n": len(good),
                "in_time": sum(r.in_time(place) for r in good),
                "slowest": max(seconds, key=lambda s: (s != s, s), default=None),
                "stated": good[0].measured[place][2] if good else None,
                "exit": sorted({str(r.exit) for r in good}),
                "stall": max((r.stall for r in good), default=None),
                # Counted once, in the first row of an ending.
                "violations": {}
                if place
                else {k: sum(r.violations.get(k, 0) for r in good) for k in kinds},
                "said": sorted({r.said for r in good if r.said}),
                "failed": [r.failed for r in same if r.failed],
            }
            found.append(row)
    return found


def shown(row: dict) -> str:
    """Write a line of the table."""
    milliseconds = [
        "-" if value is None else "never" if value != value else f"{1e3 * value:.0f}"
        for value in (row["slowest"], row["stated"], row["stall"])
    ]
    wrong = [f"{count} {kind}" for kind, count in row["violations"].items()]
    wrong += [f"did not begin: {' '.join(w.split())}" for w in row["failed"]]
    cells = [
        *(row[name] for name in ("ending", "command", "line", "measured")),
        f"{row['in_time']} of {row['n']}",
        *milliseconds,
        " ".join(row["exit"]),
        ", ".join(wrong) or "-",
    ]
    return f"| {' | '.join(cells)} |"


HEADER = (
    "| ending | command | answers after | measured | in time | slowest ms | stated ms "
    "| machine late ms | exit | violations |\n|---|---|---|---|---|---|---|---|---|---|"
)


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=2, help="of each")
    parser.add_argument("--quick", action="store_true", help="a few, in a minute")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    parser.add_argument(
        "--cold", action="store_true", help="start every program anew, not by a fork"
    )
    parser.add_argument(
        "--safe-state", choices=("limp", "hold", "open"), default="limp"
    )
    parser.add_argument("--ending", nargs="*", choices=[*ENDINGS], default=[*ENDINGS])
    parser.add_argument("--command", nargs="*", choices=COMMANDS, default=COMMANDS)
    names = [line.name for line in LINES]
    parser.add_argument("--line", nargs="*", choices=names, default=names)
    parser.add_argument("--files", type=Path, help="where the person is, or is put")
    given = parser.parse_args()
    if given.quick:
        given.n, given.ending, given.line = 1, list(QUICK), ["4 ms"]
    return given


def main() -> None:
    """Print the table."""
    given = options()
    # A shell starts what it puts into the background deaf to Ctrl-C, and so would be
    # every program that is interrupted here.
    for number in (signal.SIGINT, signal.SIGQUIT, signal.SIGHUP):
        usual = (
            signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        )
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, usual)
    lines = [line for line in LINES if line.name in given.line]
    wanted = [
        (ending, command, line, k)
        for ending, command, line in itertools.product(
            given.ending, given.command, lines
        )
        for k in range(given.n)
    ]
    with tempfile.TemporaryDirectory() as scratch:
        files = (given.files or Path(scratch)).absolute()
        person(files)
        starter = Shell() if given.cold else ForkServer(files)
        canary = Canary()

        def one(case: tuple) -> Result:
            ending, command, line, k = case
            key = f"{ending} {command} {line.name}".encode()
            return trial(
                ending,
                command,
                line,
                starter=starter,
                files=files,
                safe_state=given.safe_state,
                rng=np.random.default_rng([given.seed, k, *key]),
                canary=canary,
            )

        table = []
        if not given.json:
            print(
                f"{platform.machine()}, {os.cpu_count()} cores, {given.jobs} at a time,"
                f" seed {given.seed}, simulated xl430 of the tests, safe state "
                f"{given.safe_state}, {given.n} each\n{HEADER}",
                flush=True,
            )
        pool = ThreadPoolExecutor(given.jobs)
        try:
            results = pool.map(one, wanted)
            for _ in range(len(wanted) // given.n):
                for row in rows(list(itertools.islice(results, given.n))):
                    table.append(row)
                    if not given.json:
                        print(shown(row), flush=True)
        finally:
            pool.shutdown(cancel_futures=True)
            starter.close()
        if given.json:
            print(json.dumps(table))


if __name__ == "__main__":
    main()
