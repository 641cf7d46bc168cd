"""Does compiled marker inverse kinematics find what the plain solver finds? One table.

Frame by frame, each from the compiled solution of the frame before: the compiled solver
as it is used, the plain one until its steps are below 1e-10 rad. Simulated persons, and
real recordings where they are found (``--data``). One row a recording: how far joints
and thorax are apart at worst, in how many frames by more than 1e-6 rad or m, and by how
much the compiled solution's cost is higher at worst (relative; below 0 is lower).
"""

import argparse
import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numba
import numpy as np
import pinocchio
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import LIMIT, PRIOR, MarkerIK
from ikns.recording.files import read
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from marker_ik_oracle import PlainMarkerIK

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: Who and what is compared, whatever else is there: two people of UE_ADL, three lifts.
PEOPLE, TASKS, LIFTS = ("ADL001", "ADL005"), "ACDF", (1, 2, 3)
#: Radians or meters; what is called the same.
SAME = 1e-6


def recordings(
    data: Path | None, seeds: range
) -> Iterator[tuple[str, Skeleton, Recording]]:
    """Name, scaled body, recording."""
    for seed in seeds:
        protocol = simulate_protocol(virtual_subject(seed), seed=seed, free_seconds=10)
        skeleton, _ = scale(Skeleton.load(), protocol.static.recording)
        for trial in (protocol.free, protocol.points):
            yield f"simulated {seed}, {trial.name}", skeleton, trial.recording
    if data is None:
        return
    for name in PEOPLE:
        folder = data / "ue_adl" / name
        skeleton, _ = scale(
            Skeleton.load(),
            read(folder / f"{name}_static.csv"),
            marker_set="ue_adl",
            min_duration=0.3,
        )
        # The plain solver knows no free turns; tests/test_free_turn.py has them.
        worn = skeleton.marker_set
        rigid = tuple(replace(marker, free_turn=False) for marker in worn.markers)
        skeleton = skeleton.with_markers(replace(worn, markers=rigid))
        for task, side in product(TASKS, "LR"):
            trial = folder / f"{name}{task}{side}1.csv"
            yield trial.stem, skeleton, read(trial)
    skeleton, _ = scale(
        Skeleton.load(),
        read(data / "stoop" / "neu_t169_f250f350.c3d"),
        marker_set="plug_in_gait",
    )
    for i in LIFTS:
        (trial,) = (data / "stoop").glob(f"stoop{i}_*.c3d")
        yield trial.stem, skeleton, read(trial)


def cost(
    skeleton: Skeleton, q: np.ndarray, before: np.ndarray, seen: np.ndarray
) -> float:
    """Sum up what is minimized."""
    worn = skeleton.marker_set.markers
    weight = np.array([0.0 if m.static_only else m.weight for m in worn])
    distance = ((skeleton.markers_in_world(q) - seen) ** 2).sum(axis=1)
    turn = Rotation.from_quat(before[3:7]).inv() * Rotation.from_quat(q[3:7])
    moved = [*(q - before)[:3], turn.magnitude(), *(q - before)[7:]]
    beyond = np.maximum(q[7:] - skeleton.upper, 0)
    beyond += np.minimum(q[7:] - skeleton.lower, 0)
    total = np.nansum(weight * distance)
    return float(total + PRIOR**2 * np.square(moved).sum() + LIMIT**2 * beyond @ beyond)


def compared(
    skeleton: Skeleton, recording: Recording, every: int
) -> tuple[int, float, int, float]:
    """One recording's row."""
    markers = skeleton.marker_set.pick(recording.labels, recording.markers)
    motion = MarkerIK(skeleton).track(recording)
    fast = MarkerIK(skeleton)
    plain = PlainMarkerIK(skeleton, tolerance=1e-10, max_iterations=5000)
    apart, higher = [], []
    for i in range(1, len(markers), every):
        before = motion.q[i - 1]
        ours, theirs = (ik.solve(markers[i], before) for ik in (fast, plain))
        if np.isnan(theirs.residual):
            continue
        apart.append(np.abs(skeleton.difference(ours.q, theirs.q)).max())
        least = cost(skeleton, theirs.q, before, markers[i])
        higher.append(cost(skeleton, ours.q, before, markers[i]) / least - 1)
    beyond = int(np.sum(np.array(apart) > SAME))
    return len(apart), max(apart), beyond, max(higher)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="every 200th frame")
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--every", type=int, default=1, help="of so many frames one")
    options = parser.parse_args()
    data = options.data if options.data.is_dir() else None
    every, seeds = (200, 1) if options.quick else (options.every, options.seeds)
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, pin {pinocchio.__version__}, "
        f"seeds 0 to {seeds - 1}, every {every}. frame"
    )
    if data is None:
        print(f"real recordings: not found at {options.data}")
    print(f"{'':<26}{'frames':>8}{'apart':>10}{'> 1e-6':>8}{'cost higher by':>16}")
    total = np.zeros(2, dtype=int)
    for name, skeleton, recording in recordings(data, range(seeds)):
        n, apart, beyond, higher = compared(skeleton, recording, every)
        total += [n, beyond]
        print(f"{name:<26}{n:>8}{apart:>10.1e}{beyond:>8}{higher:>16.1e}", flush=True)
    print(f"{'all':<26}{total[0]:>8}{'':>10}{total[1]:>8}")


if __name__ == "__main__":
    main()
