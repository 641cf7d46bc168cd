"""How long does a virtual study take, and is it the same by any workers? Three tables.

Everything is simulated.

1. The study that `ikns study init` writes (10 participants, both experiments, both
   conditions, 180 tracking trials), from nothing, with this many processes.
2. A small study by one process, two, and two Dask workers: are all files the same, bit
   for bit? And killed (SIGKILL) at random instants and gone on with until it is done?
3. Memory of the running process, and of its largest worker, when 10, 50 and 100 % of a
   larger cohort's tracking is done.
"""

import argparse
import hashlib
import json
import logging
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
#: A run is killed after so long at most, s.
LONGEST = 12.0


def declared(folder: Path, table: dict[str, Any]) -> Path:
    """Make a study folder of a table."""
    folder.mkdir()
    (folder / "study.toml").write_text(tomli_w.dumps(table))
    return folder


def example(folder: Path, jobs: int, *, quick: bool) -> dict[str, Any]:
    """Time the study that ships; `quick` a small one."""
    if quick:
        declared(folder, SMALL)
    else:
        init_study(folder)
    study = read_study(folder)
    run = run_study(folder, n_jobs=jobs, participants=1 if quick else None)
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


def alike(folder: Path, kills: int, *, seed: int) -> list[dict[str, Any]]:
    """Compute a small study in four ways."""
    from distributed import LocalCluster

    rows: list[dict[str, Any]] = []
    first: dict[str, bytes] = {}

    def note(how: str, study: Path, began: float) -> None:
        found = contents(study)
        if not first:
            first.update(found)
        names = sorted(first.keys() | found.keys())
        odd = [name for name in names if first.get(name) != found.get(name)]
        sums = hashlib.sha256(b"".join(name.encode() + found[name] for name in found))
        rows.append(
            {
                "how": how,
                "seconds": time.perf_counter() - began,
                "cells": len(list_visits(study)),
                "digest": sums.hexdigest()[:12],
                "same_bits": not odd,
                "files_that_differ": odd,
            }
        )

    for jobs in (1, 2):
        study = declared(folder / f"processes-{jobs}", SMALL)
        began = time.perf_counter()
        run_study(study, n_jobs=jobs)
        note(f"{jobs} process{'es' * (jobs > 1)}", study, began)
    study = declared(folder / "dask", SMALL)
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as cluster:
        began = time.perf_counter()
        run_study(study, scheduler=cluster.scheduler_address)
        note("2 Dask workers", study, began)
    study, luck, killed = declared(folder / "killed", SMALL), random.Random(seed), 0
    began = time.perf_counter()
    for _ in range(kills):
        with subprocess.Popen([sys.executable, "-c", RUN, str(study), "2"]) as running:
            try:
                running.wait(luck.uniform(0.0, LONGEST))
            except subprocess.TimeoutExpired:
                running.send_signal(signal.SIGKILL)
                killed += 1
    run_study(study, n_jobs=2)
    note(f"2 processes, killed {killed} times", study, began)
    return rows


def memory(folder: Path, people: int, jobs: int) -> list[dict[str, Any]]:
    """Resident memory while the tracking of a cohort is simulated."""
    table = {
        "study": {"name": "cohort"},
        "cohort": {"participants": people},
        "tracking": {},
    }
    if people < 10:  # quick
        table |= {"tracking": SMALL["tracking"], "parameters": SMALL["parameters"]}
    study = declared(folder / "cohort", table)
    marks = {max(1, round(share * people)): share for share in (0.1, 0.5, 1.0)}
    rows = []

    def look(step: str, done: int, total: int) -> None:
        if step == "simulating" and done in marks:
            workers = [resident(child) for child in children(os.getpid())]
            rows.append(
                {
                    "done": done,
                    "share": marks.pop(done),
                    "process_MB": resident(os.getpid()) / 1e6,
                    "largest_worker_MB": max(workers, default=0) / 1e6,
                }
            )

    run = run_study(study, n_jobs=jobs, on_progress=look)
    for row in rows:
        row |= {"participants": people, "seconds_in_all": run.seconds}
    return rows


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
    print(
        f"\n| tracking of {rows[0]['participants']} | running process, MB "
        "| largest worker, MB |\n|---|---|---|"
    )
    for row in rows:
        print(
            f"| {row['share']:.0%} done | {row['process_MB']:.0f} "
            f"| {row['largest_worker_MB']:.0f} |"
        )
    print(f"\nThat cohort took {rows[0]['seconds_in_all']:.0f} s.")


def main() -> None:
    """Print the tables, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--people", type=int, default=60, help="of the larger cohort")
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0, help="of the kills' instants")
    parser.add_argument("--quick", action="store_true", help="few people, 1 kill")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    people, kills = options.people, options.kills
    if options.quick:
        people, kills = 1, 1
        SMALL["cohort"] = {"participants": 2}
    warm_up()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        result: dict[str, Any] = {
            "about": {
                "simulated": True,
                "machine": platform.machine(),
                "cores": os.cpu_count(),
                "python": platform.python_version(),
                "numpy": version("numpy"),
                "seed": options.seed,
            },
            "example": example(folder / "example", options.jobs, quick=options.quick),
            "alike": alike(folder, kills, seed=options.seed),
            "memory": memory(folder, people, options.jobs),
        }
    if options.json:
        print(json.dumps(result))
        return
    print(", ".join(f"{key} {value}" for key, value in result["about"].items()) + "\n")
    show(result)


if __name__ == "__main__":
    main()
