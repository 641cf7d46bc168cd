"""How long does a calibration take, from files to the map? One table.

A simulated person's static trial and ten explorations of five seconds at points of a
box, with the reaches in between, are written as C3D files. Then they are read, the body
is scaled, the markers are tracked, the map is fitted, and the subject is written, over
and over in one process; the first round also compiles or loads the kernels. At last
`ikns calibrate` does it all in a process of its own.
"""

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np
import pinocchio
import sklearn

import ikns
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.map import NullSpaceMap, null_space_samples
from ikns.recording.files import write_c3d
from ikns.simulation import simulate_protocol, virtual_subject


def round_of_steps(folder: Path) -> dict[str, float]:
    """Seconds of each step, and of all that `calibrate` does at a stretch."""
    marks = {}
    start = time.perf_counter()

    def mark(name: str) -> None:
        nonlocal start
        marks[name] = time.perf_counter() - start
        start = time.perf_counter()

    static, points = ikns.read(folder / "static.c3d"), ikns.read(folder / "points.c3d")
    mark("read two C3D files")
    skeleton, _ = scale(Skeleton.load(), static)
    mark("scale the body")
    motion = MarkerIK(skeleton).track(points, chain="right_arm")
    mark("track the markers")
    x, q = null_space_samples(motion, "right_arm")
    NullSpaceMap(10).fit(x, q)
    mark("fit the map")
    static, points = ikns.read(folder / "static.c3d"), ikns.read(folder / "points.c3d")
    subject = calibrate(static, [points], min_still=0.2)
    mark("all: read and calibrate")
    with tempfile.TemporaryDirectory() as out:
        subject.save(Path(out) / "subject")
        mark("write the subject")
    return marks


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="short trials, few rounds")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    short = {"point_seconds": 2.0, "rate": 50.0} if options.quick else {}
    protocol = simulate_protocol(
        virtual_subject(options.seed), seed=options.seed, free_seconds=1.0, **short
    )
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, scikit-learn {sklearn.__version__}, "
        f"pin {pinocchio.__version__}, seed {options.seed}; simulated"
    )
    recording = protocol.points.recording
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_c3d(folder / "static.c3d", protocol.static.recording)
        write_c3d(folder / "points.c3d", recording)
        rounds = [round_of_steps(folder) for _ in range(3 if options.quick else 10)]
        command = [str(Path(sys.executable).with_name("ikns")), "calibrate"]
        start = time.perf_counter()
        subprocess.run(
            [
                *command,
                *("--static", folder / "static.c3d"),
                *("--exploration", folder / "points.c3d"),
                *("--out", folder / "subject"),
            ],
            check=True,
            capture_output=True,
        )
        whole = time.perf_counter() - start
    n = len(recording.time)
    print(f"{n} frames, {n / recording.rate:.0f} s of exploration")
    print(f"{'s':<28}{'first':>9}{'median':>9}{'worst of the others':>22}")
    for step in rounds[0]:
        others = [marks[step] for marks in rounds[1:]]
        print(
            f"{step:<28}{rounds[0][step]:>9.3f}{np.median(others):>9.3f}"
            f"{max(others):>22.3f}"
        )
    print(f"{'ikns calibrate, a process':<28}{whole:>9.3f}")


if __name__ == "__main__":
    main()
