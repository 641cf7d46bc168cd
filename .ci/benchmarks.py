"""Run every benchmark with ``--quick``, two at a time; exit 1 if one fails.

``benchmarks.py FILE``: as soon as FILE exists, what tests need is installed. The few
benchmarks that need it, too, wait for that.

Each is a process of its own, forked from this one after the imports that nearly all of
them share: importing costs more than most of them compute.
"""

import importlib
import os
import runpy
import sys
import tempfile
import time
from pathlib import Path
from typing import BinaryIO

from ikns.live.warm_up import warm_up

AT_ONCE = 2
#: They import what only the group `test` has, or start programs that do.
WITH_TEST_PACKAGES = {
    "endings",
    "finger_faults",
    "live_loop",
    "marker_ik",
    "natural_neighbor",
    "paper_statistics",
    "publishing",
    "soak",
    "stream_latency",
    "study_cluster",
    "virtual_picking",
    "virtual_study",
}
SHARED = "numba", "pinocchio", "scipy.stats", "sklearn.cluster", "sklearn.decomposition"
Started = tuple[Path, float, BinaryIO]


def start(script: Path, said: BinaryIO) -> int:
    """Return the process that runs a benchmark; ``said`` takes what it prints."""
    sys.stdout.flush()
    if process := os.fork():
        return process
    os.dup2(said.fileno(), sys.stdout.fileno())
    os.dup2(said.fileno(), sys.stderr.fileno())
    sys.argv = [str(script), "--quick"]
    sys.path[0] = str(script.parent)
    runpy.run_path(str(script), run_name="__main__")
    sys.exit()


def possible(waiting: list[Path], installed: Path) -> list[Path]:
    """Return which of the benchmarks can run now."""
    if installed.exists():
        return waiting
    return [script for script in waiting if script.stem not in WITH_TEST_PACKAGES]


def main(installed: Path) -> None:
    """Print what each benchmark printed, in one piece, as soon as it has ended."""
    for name in SHARED:
        importlib.import_module(name)
    warm_up()
    # The longest is last in the alphabet.
    waiting = sorted((Path(__file__).parents[1] / "benchmarks").glob("*.py"))
    running: dict[int, Started] = {}
    failed = []
    while waiting or running:
        while len(running) < AT_ONCE and (able := possible(waiting, installed)):
            script, said = able[-1], tempfile.TemporaryFile()
            waiting.remove(script)
            running[start(script, said)] = script, time.monotonic(), said
        if not running:
            time.sleep(1)
            continue
        process, status, usage = os.wait3(0)
        script, since, said = running.pop(process)
        said.seek(0)
        took = time.monotonic() - since
        busy = usage.ru_utime + usage.ru_stime
        sys.stdout.write(f"\n--- {script.name} ({took:.0f} s, {busy:.0f} CPU s)\n")
        sys.stdout.write(said.read().decode())
        said.close()
        if status:
            failed.append(script.name)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
