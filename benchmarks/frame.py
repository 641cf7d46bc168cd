"""How long does a live frame take, from markers to signal? One table.

A simulated person is calibrated; then the markers of the reaches between the points (1
mm of noise, 3 % hidden) go frame by frame through the one compiled call, through the
same steps one by one in Python, and through the plain solver with the same steps. The
contenders take turns in windows in random order. Then a million frames go through the
one call (not with --quick), and the memory of the process is read off as they do.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import pinocchio

import ikns
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.live.control import FrameSolver
from ikns.motion.marker_ik import MarkerIK
from ikns.simulation import Protocol, simulate_protocol, virtual_subject

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from marker_ik_oracle import PlainMarkerIK

WINDOW = 100


def one_by_one(
    subject: Subject, solver: MarkerIK | PlainMarkerIK
) -> Callable[[np.ndarray], float]:
    """Inverse kinematics, then the hand, then the signal."""
    joints = ikns.body.chains.chain_joints(subject.chain)
    columns = [subject.skeleton.joint_names.index(name) for name in joints]
    pose = None

    def solve(markers: np.ndarray) -> float:
        nonlocal pose
        pose = solver.solve(markers, None if pose is None else pose.q)
        hand = subject.skeleton.hands_in_thorax(pose.q)[0][0]
        return subject.null_space_map.control_signal(pose.q[7:][columns], hand)

    return solve


def in_one(subject: Subject) -> Callable[[np.ndarray], float]:
    """One call."""
    solver = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    return lambda markers: solver.solve(markers).c[0]


def race(
    contenders: dict[str, Callable[[np.ndarray], float]],
    frames: np.ndarray,
    rng: np.random.Generator,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Signals and seconds of each frame."""
    signals = {name: np.empty(len(frames)) for name in contenders}
    seconds = {name: np.empty(len(frames)) for name in contenders}
    for solve in contenders.values():
        for markers in frames[:5]:
            solve(markers)
    for first in range(0, len(frames), WINDOW):
        for name in rng.permutation(list(contenders)):
            solve = contenders[name]
            for i in range(first, min(first + WINDOW, len(frames))):
                start = time.perf_counter()
                signals[name][i] = solve(frames[i])
                seconds[name][i] = time.perf_counter() - start
    return signals, seconds


def resident() -> int:
    """Memory of this process, kB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


def there_and_back(frames: np.ndarray) -> np.ndarray:
    """Frames forwards and backwards, so that they can be repeated without a jump."""
    return np.concatenate([frames, frames[::-1]])


def prepared(seed: int, quick: bool) -> tuple[Subject, Protocol]:
    """Calibrate a simulated person."""
    short = {"point_seconds": 2.0, "rate": 50.0} if quick else {}
    protocol = simulate_protocol(
        virtual_subject(seed), seed=seed, free_seconds=1.0, **short
    )
    static, points = protocol.static.recording, protocol.points.recording
    return calibrate(static, [points], min_still=0.2), protocol


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few frames")
    parser.add_argument("--frames", type=int, help="frames to time")
    parser.add_argument("--million", type=int, help="frames for the memory")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, pin {pinocchio.__version__}, seed {options.seed}; "
        "simulated"
    )
    took = ikns.warm_up()
    print(f"warm-up {took:.1f} s")
    subject, protocol = prepared(options.seed, options.quick)
    recording = protocol.points.recording
    markers = subject.skeleton.marker_set.pick(recording.labels, recording.markers)
    n = options.frames or (200 if options.quick else 5000)
    frames = np.resize(there_and_back(markers), (n, *markers.shape[1:]))
    contenders = {
        "one compiled call": in_one(subject),
        "compiled, step by step": one_by_one(subject, MarkerIK(subject.skeleton)),
        "plain solver, step by step": one_by_one(
            subject, PlainMarkerIK(subject.skeleton)
        ),
    }
    signals, seconds = race(contenders, frames, rng)
    base = np.percentile(seconds["one compiled call"], 50)
    print(
        f"{'us a frame, ' + str(n) + ' frames':<32}{'p50':>9}{'p99':>9}{'p99.9':>9}"
        f"{'x p50':>8}{'largest difference of c':>26}"
    )
    for name, spent in seconds.items():
        p50, p99, p999 = np.percentile(spent, [50, 99, 99.9])
        apart = np.nanmax(np.abs(signals[name] - signals["one compiled call"]))
        print(
            f"{name:<32}{1e6 * p50:>9.4g}{1e6 * p99:>9.4g}{1e6 * p999:>9.4g}"
            f"{p50 / base:>8.3g}{apart:>26.1e}"
        )
    million = options.million or (2_000 if options.quick else 1_000_000)
    solve, every = contenders["one compiled call"], million // 10
    loop = there_and_back(markers)
    marks, start = [resident()], time.perf_counter()
    for i in range(million):
        solve(loop[i % len(loop)])
        if (i + 1) % every == 0:
            marks.append(resident())
    spent = time.perf_counter() - start
    growth = ", ".join(f"{mark - marks[1]:+d}" for mark in marks[1:])
    print(
        f"{million} frames in {spent:.1f} s ({1e6 * spent / million:.1f} us each); "
        f"memory against the first tenth, kB: {growth}"
    )


if __name__ == "__main__":
    main()
