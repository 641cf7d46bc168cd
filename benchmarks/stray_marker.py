"""Measure how far a marker may stray before a frame stops counting, and what c does.

One visible marker of the chain is moved by a distance in a random direction, in one
frame of a simulated recording, and the pose solved from the pose before. Compared are
two checks: root mean square distance of all markers alone, and with it the largest
distance of a marker of the chain. What the second may not refuse is the distances that
real people's markers have anyway: they stand below, where their recordings are.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from ikns import MarkerIK, Skeleton, read, scale
from ikns.calibration import calibrate, in_sight, sight_needs
from ikns.control import FrameSolver
from ikns.control.controller import Settings
from ikns.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject
from ikns.subject import Subject

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
DISTANCES = (0.03, 0.05, 0.08, 0.10, 0.12, 0.15, 0.20, 0.25, 0.30, 0.40, 0.50)
CHECKS = Settings()


def person(seed: int) -> tuple[Subject, Recording]:
    """Simulate somebody at ten points, cameras' noise and occlusion included."""
    protocol = simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=2.0,
    )
    points = protocol.points.recording
    return calibrate(protocol.static.recording, [points]), points


def strayed(seed: int, draws: int) -> np.ndarray:
    """Draw frames, markers and directions: (draws, distances, 3).

    The last axis is the rms distance, the worst distance, both m, and the change of c.
    """
    subject, recording = person(seed)
    skeleton, chain = subject.skeleton, subject.chain
    seen = skeleton.marker_set.pick(recording.labels, recording.markers)
    shown = np.all(list(in_sight(skeleton, recording, chain).values()), axis=0)
    of_chain = np.concatenate([c for c, _ in sight_needs(skeleton, chain).values()])
    rng = np.random.default_rng(seed)
    solver = FrameSolver(skeleton, subject.null_space_map, chain)
    rows = []
    while len(rows) < draws:
        frame, marker = rng.choice(np.flatnonzero(shown)), rng.choice(of_chain)
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        if not np.isfinite(seen[frame, marker]).all():
            continue
        solver.reset()
        true = solver.solve(seen[frame])
        row = []
        for distance in DISTANCES:
            markers = seen[frame].copy()
            markers[marker] += distance * direction
            solver.reset(true.q)
            found = solver.solve(markers)
            change = abs(float(found.c[0] - true.c[0]))
            row.append((found.residual, found.worst_residual, change))
        rows.append(row)
    return np.array(rows)


def real(folder: Path, *, quick: bool) -> list[dict]:
    """Worst distance of the chain's markers in real recordings, a row a trial, mm."""
    rows = []
    for name in ("ADL001", "ADL005"):
        static = read(folder / name / f"{name}_static.csv")
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3
        )
        for task in "F" if quick else "FADC":
            for side, letter in (("right", "R"), ("left", "L")):
                recording = read(folder / name / f"{name}{task}{letter}1.csv")
                motion = MarkerIK(skeleton).track(recording)
                seen = skeleton.marker_set.pick(recording.labels, recording.markers)
                model = np.stack([skeleton.markers_in_world(q) for q in motion.q])
                needs = sight_needs(skeleton, f"{side}_arm").values()
                of_chain = np.concatenate([columns for columns, _ in needs])
                away = np.linalg.norm(model - seen, axis=2)[:, of_chain]
                worst = 1000 * np.nanmax(away, axis=1)
                rows.append(
                    {
                        "trial": f"{name}{task}{letter}1",
                        "frames": len(worst),
                        "p50_mm": float(np.median(worst)),
                        "p99_mm": float(np.percentile(worst, 99)),
                        "worst_mm": float(worst.max()),
                    }
                )
    return rows


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--draws", type=int, default=2000, help="per person")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="one person, few draws")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    people, draws = (1, 100) if options.quick else (options.people, options.draws)
    found = np.concatenate(
        [strayed(options.seed + person, draws) for person in range(people)]
    )
    rms = found[..., 0] <= CHECKS.max_residual
    both = rms & (found[..., 1] <= CHECKS.max_worst_residual)
    rows = []
    for k, distance in enumerate(DISTANCES):
        row: dict[str, float | None] = {"distance_m": distance}
        for name, counts in (("rms", rms[:, k]), ("both", both[:, k])):
            change = found[counts, k, 2]
            row[f"{name}_counts"] = float(counts.mean())
            row[f"{name}_c_p95"] = (
                float(np.percentile(change, 95)) if len(change) else None
            )
        rows.append(row)
    folder = options.data / "ue_adl"
    trials = real(folder, quick=options.quick) if folder.is_dir() else []
    if options.json:
        print(json.dumps({"simulated": rows, "real": trials}))
        return
    print(
        f"Simulated: {people} people x {draws} draws of frame, marker, direction. A "
        f"frame counts\nwith rms <= {1000 * CHECKS.max_residual:g} mm, and with the "
        f"worst marker <= {1000 * CHECKS.max_worst_residual:g} mm besides.\n"
    )
    print(
        "| astray, m | counts by rms, % | c then off by (p95) | by both, % | off by |"
    )
    print("|---|---|---|---|---|")
    for row in rows:
        cells = [f"{row['distance_m']:.2f}"]
        for name in ("rms", "both"):
            change = row[f"{name}_c_p95"]
            cells.append(f"{100 * row[f'{name}_counts']:.2f}")
            cells.append("-" if change is None else f"{change:.2f}")
        print(f"| {' | '.join(cells)} |")
    if not trials:
        print(f"\nNo real recordings in {folder}: not measured.")
        return
    print("\nReal: largest distance of a marker of the chain, mm\n")
    print("| trial | frames | p50 | p99 | largest |")
    print("|---|---|---|---|---|")
    for trial in trials:
        print(
            f"| {trial['trial']} | {trial['frames']} | {trial['p50_mm']:.0f} | "
            f"{trial['p99_mm']:.0f} | {trial['worst_mm']:.0f} |"
        )


if __name__ == "__main__":
    main()
