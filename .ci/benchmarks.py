"""Run every benchmark with ``--quick``, two at a time; exit 1 if one fails.

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


def main() -> None:
    """Print what each benchmark printed, in one piece, as soon as it has ended."""
    for name in SHARED:
        importlib.import_module(name)
    warm_up()
    # The longest is last in the alphabet.
    waiting = sorted((Path(__file__).parents[1] / "benchmarks").glob("*.py"))
    running: dict[int, Started] = {}
    failed = []
    while waiting or running:
        while waiting and len(running) < AT_ONCE:
            script, said = waiting.pop(), tempfile.TemporaryFile()
            running[start(script, said)] = script, time.monotonic(), said
        process, status = os.wait()
        script, since, said = running.pop(process)
        said.seek(0)
        took = time.monotonic() - since
        sys.stdout.write(f"\n--- {script.name} ({took:.0f} s)\n{said.read().decode()}")
        said.close()
        if status:
            failed.append(script.name)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
