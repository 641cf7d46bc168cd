"""How long does a virtual study take, and is it the same by any workers? Three tables.

Everything is simulated.

1. The study that `ikns study init` writes (10 participants, both experiments, both
   conditions, 180 tracking trials), from nothing, with this many processes.
2. A small study by one process and by two: are all files the same, bit for bit? And
   killed (SIGKILL) at random instants and gone on with until it is done?
   `study_cluster.py` asks the same of Dask workers.
3. Memory of the running process, and of its largest worker, when 10, 50 and 100 % of a
   larger cohort's tracking is done.

With `--quick` one small study answers all three: by one process, and by two that are
killed on the way.
"""

import argparse
import hashlib
import json
import os
import platform
import random
import signal
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import tomli_w

from ikns.experiments.study import init_study, read_study, run_study
from ikns.experiments.visits import list_visits, read_visit
from ikns.live.warm_up import warm_up

#: A study that is quick to simulate: coarse frames, one profile, one object.
SMALL: dict[str, Any] = {
    "study": {"name": "small"},
    "cohort": {"participants": 4},
    "tracking": {"profiles": ["T1"], "repeats": 1, "seconds": 15},
    "picking": {"objects": ["A"]},
    "parameters": {"rate": 50, "point_seconds": 2},
}
RUN = """
import sys
from ikns.experiments.study import run_study
if __name__ == "__main__":
    run_study(sys.argv[1], n_jobs=int(sys.argv[2]))
"""
#: A run is killed after so long at most, s; with --quick it ends sooner.
LONGEST = 12.0
SOON = 4.0


def declared(folder: Path, table: dict[str, Any]) -> Path:
    """Make a study folder of a table."""
    folder.mkdir()
    (folder / "study.toml").write_text(tomli_w.dumps(table))
    return folder


def example(folder: Path, jobs: int, people: int | None) -> dict[str, Any]:
    """Time the study that is in a folder, or of its first people."""
    study = read_study(folder)
    before = os.times()
    run = run_study(folder, n_jobs=jobs, participants=people)
    cpu = sum(os.times()[:4]) - sum(before[:4])
    visits = [read_visit(path) for path in list_visits(folder)]
    trials = {
        name: sum(len(v.attempts) for v in visits if v.about["experiment"] == name)
        for name in study.designs
    }
    size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())
    return {
        "participants": run.cells // len(study.designs),
        "processes": jobs,
        "cells": run.simulated,
        "tracking_trials": trials["tracking"],
        "picks": trials["picking"],
        "failed": len(run.failed),
        "seconds": run.seconds,
        "cpu": cpu,
        "cells_per_s": run.simulated / run.seconds,
        "bytes_per_cell": size / run.simulated,
    }


def contents(study: Path) -> dict[str, bytes]:
    """Every file of the visits by name."""
    visits = study / "visits"
    return {
        path.relative_to(visits).as_posix(): path.read_bytes()
        for path in sorted(visits.rglob("*"))
        if path.is_file()
    }


class Alike:
    """Compares the files of studies, bit for bit."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._first: dict[str, bytes] = {}

    def note(self, how: str, study: Path, seconds: float) -> None:
        """Add a row; the first one's files are what the others should be."""
        found = contents(study)
        first = self._first = self._first or found
        names = sorted(first.keys() | found.keys())
        odd = [name for name in names if first.get(name) != found.get(name)]
        sums = hashlib.sha256(b"".join(name.encode() + found[name] for name in found))
        self.rows.append(
            {
                "how": how,
                "seconds": seconds,
                "cells": len(list_visits(study)),
                "digest": sums.hexdigest()[:12],
                "same_bits": not odd,
                "files_that_differ": odd,
            }
        )


def killed_runs(study: Path, kills: int, *, seed: int, longest: float = LONGEST) -> int:
    """Run a study in two processes, and kill it; return how often."""
    luck, killed = random.Random(seed), 0
    for _ in range(kills):
        with subprocess.Popen([sys.executable, "-c", RUN, str(study), "2"]) as running:
            try:
                running.wait(luck.uniform(0.0, longest))
            except subprocess.TimeoutExpired:
                running.send_signal(signal.SIGKILL)
                killed += 1
    return killed


def cohort(folder: Path, people: int) -> Path:
    """Make a study of tracking alone."""
    table = {"study": {"name": "cohort"}, "cohort": {"participants": people}}
    return declared(folder, table | {"tracking": {}})


def memory(study: Path, jobs: int) -> list[dict[str, Any]]:
    """Resident memory while a study is simulated, or what is left of it."""
    marks, rows = {0.1, 0.5, 1.0}, []
    first: list[int] = []

    def look(step: str, done: int, total: int) -> None:
        if step != "simulating":
            return
        first.append(done)
        share = (done - first[0]) / max(total - first[0], 1)
        passed = {mark for mark in marks if share >= mark}
        if not passed:
            return
        marks.difference_update(passed)
        workers = [resident(child) for child in children(os.getpid())]
        rows.append(
            {
                "done": done,
                "share": max(passed),
                "process_MB": resident(os.getpid()) / 1e6,
                "largest_worker_MB": max(workers, default=0) / 1e6,
            }
        )

    run = run_study(study, n_jobs=jobs, on_progress=look)
    people = read_study(study).participants
    for row in rows:
        row |= {"participants": people, "seconds_in_all": run.seconds}
    return rows


def tables(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Compute the three tables."""
    init_study(folder / "example")
    shipped = example(folder / "example", options.jobs, options.first)
    alike = Alike()
    for jobs in (1, 2):
        study = declared(folder / f"processes-{jobs}", SMALL)
        run = run_study(study, n_jobs=jobs)
        alike.note(f"{jobs} process{'es' * (jobs > 1)}", study, run.seconds)
    study = declared(folder / "killed", SMALL)
    began = time.perf_counter()
    killed = killed_runs(study, options.kills, seed=options.seed)
    run_study(study, n_jobs=2)
    took = time.perf_counter() - began
    alike.note(f"2 processes, killed {killed} times", study, took)
    found = memory(cohort(folder / "cohort", options.people), options.jobs)
    return {"example": shipped, "alike": alike.rows, "memory": found}


def quick_tables(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Compute them all of one small study, twice simulated."""
    table, alike = SMALL | {"cohort": {"participants": 1}}, Alike()
    study = declared(folder / "one", table)
    small = example(study, 1, None)
    alike.note("1 process", study, small["seconds"])
    study = declared(folder / "killed", table)
    began = time.perf_counter()
    killed = killed_runs(study, 1, seed=options.seed, longest=SOON)
    found = memory(study, 2)
    took = time.perf_counter() - began
    alike.note(f"2 processes, killed {killed} times", study, took)
    return {"example": small, "alike": alike.rows, "memory": found}


def resident(process: int) -> int:
    """Resident memory, bytes; 0 of a process that is gone."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0
    sizes = [line.split()[1] for line in status.splitlines() if line[:6] == "VmRSS:"]
    return int(sizes[0]) * 1024 if sizes else 0


def children(process: int) -> list[int]:
    """Return the processes that this one started, and those that they did."""
    found = []
    for tasks in Path(f"/proc/{process}/task").glob("*/children"):
        for child in map(int, tasks.read_text().split()):
            found += [child, *children(child)]
    return found


def show(result: dict[str, Any]) -> None:
    """Print the tables."""
    e = result["example"]
    print("| example study (simulated) | |\n|---|---|")
    print(
        f"| participants, processes | {e['participants']}, {e['processes']} |\n"
        f"| tracking trials, picks | {e['tracking_trials']}, {e['picks']} |\n"
        f"| cells, of which failed | {e['cells']}, {e['failed']} |\n"
        f"| wall time | {e['seconds']:.0f} s ({e['cells_per_s']:.2f} cells/s) |\n"
        f"| CPU time | {e['cpu']:.0f} s ({e['cpu'] / e['participants']:.1f} a person) "
        "|\n"
        f"| on disk | {e['bytes_per_cell'] / 1e3:.0f} kB a cell |"
    )
    print(
        "\n| small study by | cells | s | digest | same bits |\n|---|---|---|---|---|"
    )
    for row in result["alike"]:
        print(
            f"| {row['how']} | {row['cells']} | {row['seconds']:.0f} | {row['digest']} "
            f"| {'yes' if row['same_bits'] else 'NO: ' + row['files_that_differ'][0]} |"
        )
    rows = result["memory"]
    if not rows:
        print("\nThe killed run had done all before it could be killed.")
        return
    print(
        f"\n| participants: {rows[0]['participants']} | running process, MB "
        "| largest worker, MB |\n|---|---|---|"
    )
    for row in rows:
        print(
            f"| {row['share']:.0%} done | {row['process_MB']:.0f} "
            f"| {row['largest_worker_MB']:.0f} |"
        )
    print(f"\nThat took {rows[0]['seconds_in_all']:.0f} s.")


def main() -> None:
    """Print the tables, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--first", type=int, help="people of the shipped study; all")
    parser.add_argument("--people", type=int, default=60, help="of the larger cohort")
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0, help="of the kills' instants")
    parser.add_argument("--quick", action="store_true", help="one person, 1 kill")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    warm_up()
    with tempfile.TemporaryDirectory() as place:
        compute = quick_tables if options.quick else tables
        result: dict[str, Any] = {
            "about": {
                "simulated": True,
                "machine": platform.machine(),
                "cores": os.cpu_count(),
                "python": platform.python_version(),
                "numpy": version("numpy"),
                "seed": options.seed,
            },
            **compute(Path(place), options),
        }
    if options.json:
        print(json.dumps(result))
        return
    print(", ".join(f"{key} {value}" for key, value in result["about"].items()) + "\n")
    show(result)


if __name__ == "__main__":
    main()
