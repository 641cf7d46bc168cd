"""How fast, and how well, are markers turned into joint angles? One table.

A simulated person (24 degrees of freedom, 24 markers, 1 to 3 mm of noise per axis, 6 %
of the markers hidden) reaches about with both arms. Every solver gets the same body,
the same frames in the same order and the same start, goes from frame to frame with its
own answer to the last one, and lives on one core. The recording is cut into windows; in
each window the solvers take turns in random order. Only the call that solves is timed,
in CPU time of its thread, so that what else runs on the machine counts less.
Before anything is timed each solver's own model of the body must put the markers within
1e-9 m of where ours does.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import importlib.metadata
import os
import platform
from pathlib import Path

import numpy as np
from peers.accuracy import Answer, OwnCost, judge, to_own_minimum
from peers.ours import Batch
from peers.problem import (
    ACCURACY,
    NOISE,
    OCCLUDED,
    Problem,
    from_coordinates,
    simulated,
)
from threadpoolctl import threadpool_limits

from ikns.motion.marker_ik.pose import PRIOR, PRIOR_FROM_SCRATCH

OPENSIM = "OpenSim InverseKinematicsSolver"
LIVE, BATCH = "ikns, one frame a call", "ikns, a recording a call"
#: The package's cost; that of the task-based solvers.
OURS = OwnCost(pull=PRIOR, limits=True)
TASKS = OwnCost(pull=PRIOR, trunk=False)

#: Name; where it is; its options; what it minimizes, None for a filter.
SOLVERS = {
    OPENSIM: ("opensim_process.OpenSim", {}, OwnCost()),
    "biorbd Kalman filter": ("biorbd_kalman.Biorbd", {}, None),
    # Of powers of ten the noise factor that serves these frames best.
    "biorbd Kalman filter, tuned": ("biorbd_kalman.Biorbd", {"noise": 1e-6}, None),
    "pin-pink frame tasks": ("pink_tasks.Pink", {}, TASKS),
    "mink frame tasks": ("mink_tasks.Mink", {}, TASKS),
    "scipy least_squares, differences": (
        "scipy_least_squares.LeastSquares",
        {"analytic": False},
        OwnCost(),
    ),
    "scipy least_squares, Jacobian": (
        "scipy_least_squares.LeastSquares",
        {"analytic": True},
        OwnCost(),
    ),
    "ikns, plain reference": ("ours.Plain", {}, OURS),
    LIVE: ("ours.Live", {}, OURS),
    "ikns, without pull and limits": (
        "ours.WithoutPull",
        {},
        OwnCost(pull=PRIOR_FROM_SCRATCH),
    ),
}
#: Frames in a window, and windows between two runs of the batch.
WINDOW, BATCH_EVERY = 100, 5
#: How far the models of the body may be apart, m.
SAME_BODY = 1e-9
#: The distance to others' own minimum is taken on every so manieth frame; it is slow
#: to find where a solver stops far from it.
THINNED = 10


def build(problem: Problem) -> dict[str, object]:
    """Set every solver up; None for those that are not installed."""
    solvers: dict[str, object] = {}
    rng = np.random.default_rng(0)
    poses = from_coordinates(rng.uniform(-1, 1, (5, 24)))
    for name, (place, options, _) in SOLVERS.items():
        module, cls = place.split(".")
        try:
            kind = getattr(importlib.import_module(f"peers.{module}"), cls)
            solver = kind(problem, **options)
        except ImportError:
            solvers[name] = None
            continue
        for q in poses:
            apart = solver.markers_at(q) - problem.skeleton.markers_in_world(q)
            if not np.abs(apart).max() < SAME_BODY:
                raise SystemExit(f"{name}: markers {np.abs(apart).max()} m apart.")
        # Compile, fill caches, and go back.
        solver.begin()
        solver.run(0, min(20, len(problem.markers)))
        solver.begin()
        solvers[name] = solver
    return solvers


def race(
    problem: Problem, solvers: dict[str, object], rng: np.random.Generator
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return configurations (T, 25) and seconds of each frame, batch: of each run."""
    batch, n = Batch(problem), len(problem.markers)
    batch.run()
    names = [name for name, solver in solvers.items() if solver is not None]
    parts: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {name: [] for name in names}
    whole = []
    for window, first in enumerate(range(0, n, WINDOW)):
        turns = [*names, BATCH] if window % BATCH_EVERY == 0 else names
        for name in rng.permutation(turns):
            if name == BATCH:
                whole.append(batch.run())
            else:
                parts[name].append(solvers[name].run(first, min(first + WINDOW, n)))
    q = {name: np.concatenate([part[0] for part in parts[name]]) for name in names}
    seconds = {
        name: np.concatenate([part[1] for part in parts[name]]) for name in names
    }
    q[BATCH] = whole[0][0]
    seconds[BATCH] = np.array([spent for _, spent in whole])
    return q, seconds


def row(
    name: str,
    seconds: dict[str, np.ndarray],
    answers: dict[str, Answer],
    least: np.ndarray,
    apart: np.ndarray | None,
) -> list[str]:
    """One solver's line of the table."""
    spent, answer, opensim = 1e6 * seconds[name], answers[name], answers.get(OPENSIM)
    times = np.percentile(spent, [50, 99, 99.9])
    cells = [f"{value:.0f}" if value >= 100 else f"{value:.1f}" for value in times]
    if name == BATCH:  # means of the recording, not frames
        cells[1:] = ["-", "-"]
    if opensim is None:
        cells += ["-", "-"]
    else:
        base = np.percentile(1e6 * seconds[OPENSIM], [50, 99])
        cells += [f"{value:.3g}" for value in base / times[:2]]
        if name == BATCH:
            cells[-1] = "-"
    error = np.degrees(answer.error)
    excess = 100 * (answer.cost / least - 1)
    cells += [
        f"{1e3 * np.sqrt(answer.cost.sum() / answer.seen.sum()):.3f}",
        f"{np.sqrt(np.mean(error**2)):.2f}",
        f"{np.abs(error).max():.1f}",
        f"{np.median(excess):.2g}",
        f"{excess.max():.2g}",
        f"{answer.rest.max():.2g}",
    ]
    if opensim is None:
        cells += ["-", "-"]
    else:
        above = answer.distance - opensim.distance
        worse = (above > 0) & (answer.rest > 1)
        cells += [f"{100 * worse.mean():.3g}", f"{1e6 * above.max():.2g}"]
    if apart is None:
        cells += ["-", "-"]
    else:
        cells += [f"{np.median(apart):.1g}", f"{apart.max():.1g}"]
    return cells


HEADINGS = (
    "solver",
    "p50 us",
    "p99 us",
    "p99.9 us",
    "OpenSim p50 / p50",
    "OpenSim p99 / p99",
    "marker distance mm",
    "angle error deg",
    "worst deg",
    "cost over best, median %",
    "worst %",
    "OpenSim's stopping test, worst",
    "frames worse than OpenSim %",
    "distance over OpenSim's, worst um",
    "to own minimum, median deg",
    "worst deg",
)

LEGEND = """
Times are CPU times of one thread; reading its clock is in them (1 us).
p50, p99, p99.9: one frame; for a recording a call, the mean frame of the median run.
marker distance, angle error: root mean square over seen markers, and over 18 joints
against the truth; worst: one joint in one frame.
cost over best: sum of squared marker distances over the least that any solver found for
the frame.
stopping test: largest scaled gradient of that cost in units of OpenSim's accuracy
(1e-5); at 1 and below OpenSim would stop.
worse than OpenSim: the marker distance is above OpenSim's, and the gradient is above
what OpenSim's accuracy allows.
to own minimum: largest joint angle between the answer and the exact minimum of what the
solver minimizes (its pull to the pose before included); ours on every frame, others'
on every tenth.
"""


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=6000, help="at 100 Hz")
    parser.add_argument("--seed", type=int, default=1, help="person, motion, order")
    parser.add_argument("--quick", action="store_true", help="150 frames")
    options = parser.parse_args()
    n = 150 if options.quick else options.frames
    problem = simulated(n, options.seed)
    with threadpool_limits(1):
        solvers = build(problem)
        gc.collect()
        gc.disable()
        q, seconds = race(problem, solvers, np.random.default_rng(options.seed))
        gc.enable()
        answers = {name: judge(problem, poses) for name, poses in q.items()}
        least = np.min([answer.cost for answer in answers.values()], axis=0)
        print(
            f"Simulated frames: {n}, seed {options.seed}, {OCCLUDED:.0%} of the "
            f"markers hidden, noise {1e3 * NOISE[0]:g} to {1e3 * NOISE[1]:g} mm, "
            f"tolerance {ACCURACY:g}; windows of {WINDOW} frames in shuffled order."
        )
        print(machine() + "\n")
        print("| " + " | ".join(HEADINGS) + " |")
        print("|" + " --- |" * len(HEADINGS))
        for name in [*SOLVERS, BATCH]:
            solver = solvers.get(name)
            if name not in q:
                print(f"| {name} | not installed |" + " |" * (len(HEADINGS) - 2))
                continue
            own = SOLVERS[name][2] if name in SOLVERS else None
            apart = None
            if own is not None:
                rows = np.arange(1, n, 1 if name.startswith("ikns") else THINNED)
                apart = np.degrees(to_own_minimum(problem, q[name], own, rows))
            version = getattr(solver, "version", solvers[LIVE].version)
            cells = row(name, seconds, answers, least, apart)
            print(f"| {name} ({version.split('-')[0]}) | " + " | ".join(cells) + " |")
        print(LEGEND)
        calls = {
            name: solver.call_seconds()
            for name, solver in solvers.items()
            if hasattr(solver, "call_seconds")
        }
        print("Within these times, a call that has nothing to solve takes (us):")
        print(", ".join(f"{name} {1e6 * spent:.2g}" for name, spent in calls.items()))
        if solvers[OPENSIM] is not None:
            solvers[OPENSIM].close()


def machine() -> str:
    """Processor, cores, load and versions."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    models = [line.split(":")[1].strip() for line in lines if "model name" in line]
    versions = ", ".join(
        f"{name} {importlib.metadata.version(name)}"
        for name in ("numpy", "numba", "pin", "scipy")
    )
    return (
        f"{(models or [platform.machine()])[0]}, {os.cpu_count()} cores (one used, "
        f"load {os.getloadavg()[0]:.1f}), Python {platform.python_version()}, "
        f"{versions}."
    )


if __name__ == "__main__":
    main()
