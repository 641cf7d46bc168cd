"""Do moving frames find segment lengths better than a static trial? Virtual subjects.

Each simulated subject stands still, explores with the right arm and holds the hand at
ten points; the left arm rests. Compared are the static trial alone (ikns.scale) and the
joint fit of lengths, marker offsets and postures over 60 frames (ikns.symbolic), once
with the errors of all frames taken as one frame's (the default: skin repeats them) and
once as independent. Lengths are known exactly.
"""

import argparse
import json
import os
import platform
import time

import casadi
import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.simulation import simulate_protocol, virtual_subject
from ikns.symbolic import fit_lengths

FRAMES = 60
GOAL = 5.0  # mm, of the worst segment
CONDITIONS: dict[str, dict[str, object]] = {
    "1 mm noise, landmarks exact": {"palpation_sd": 0.0},
    "and landmarks palpated to 2 mm": {},
    "with 6 mm soft tissue": {"soft_tissue": 6e-3},
}
METHODS = {
    "static trial alone": None,
    "with 60 frames as one": 1.0,
    "with 60 independent frames": float(FRAMES),
}


def subject(seed: int, *, seconds: float, **options: object) -> dict:
    """Return errors (mm), spreads (mm) and times of one simulated subject."""
    palpation = float(options.pop("palpation_sd", 2e-3))
    person = virtual_subject(seed, palpation_sd=palpation)
    run = simulate_protocol(
        person, seed=seed, free_seconds=10, point_seconds=seconds, rate=50, **options
    )
    adult, true = person.adult, person.skeleton.segment_lengths
    generic = Skeleton.from_anthropometry(adult.stature_m, adult.mass_kg, adult.sex)
    result: dict[str, dict] = {}
    for name, worth in METHODS.items():
        if worth is None:
            continue
        started = time.perf_counter()
        _, found = fit_lengths(
            generic,
            run.static.recording,
            [run.points.recording, run.free.recording],
            n_frames=FRAMES,
            independent_frames=worth,
        )
        spent = time.perf_counter() - started
        both = {
            name: (found.lengths, found.length_sd),
            "static trial alone": (found.static_lengths, found.static_length_sd),
        }
        for method, (lengths, sd) in both.items():
            result[method] = {
                "error": {k: 1000 * (lengths[k] - true[k]) for k in true},
                "sd": {k: 1000 * sd[k] for k in true},
            }
        result[name] |= {
            "seconds": spent,
            "solved": found.solved,
            "status": found.status,
            "iterations": found.iterations,
            "marker_sd_mm": 1000 * found.marker_sd,
            "frames": found.frames,
        }
    return result


def cell(values: np.ndarray) -> str:
    """Median and worst of absolute values."""
    return f"{np.median(np.abs(values)):.2f} ({np.abs(values).max():.2f})"


def print_table(condition: str, people: list[dict]) -> None:
    """Print errors by segment."""
    print(
        f"\nsimulated, {condition}: {len(people)} subjects, error, median (worst), mm\n"
    )
    print("| segment | " + " | ".join(METHODS) + " | least sd over static sd |")
    print("|---" * (len(METHODS) + 2) + "|")
    segments = list(people[0]["static trial alone"]["error"])
    ways = {m: [p[m] for p in people] for m in METHODS}
    for segment in segments:
        cells = [
            cell(np.array([row["error"][segment] for row in rows]))
            for rows in ways.values()
        ]
        last, first = ways["with 60 independent frames"], ways["static trial alone"]
        ratio = np.median(
            [
                a["sd"][segment] / b["sd"][segment]
                for a, b in zip(last, first, strict=True)
            ]
        )
        print(f"| {segment} | " + " | ".join(cells) + f" | {ratio:.2f} |")
    for label, side in (("explored arm", "right"), ("resting arm", "left")):
        worst = {
            m: np.array(
                [
                    max(abs(e) for s, e in r["error"].items() if s.startswith(side))
                    for r in rows
                ]
            )
            for m, rows in ways.items()
        }
        print(f"| worst, {label} | " + " | ".join(map(cell, worst.values())) + " | |")
        within = [f"{(w <= GOAL).sum()} of {len(w)}" for w in worst.values()]
        print(f"| within {GOAL:g} mm | " + " | ".join(within) + " | |")
    covered = [
        np.mean([abs(r["error"][s]) <= 2 * r["sd"][s] for r in rows for s in segments])
        for rows in ways.values()
    ]
    print(
        "| within 2 sd, % | " + " | ".join(f"{100 * c:.0f}" for c in covered) + " | |"
    )
    for method, rows in ways.items():
        if "seconds" in rows[0]:
            print(
                f"\n{method}: {np.median([r['seconds'] for r in rows]):.1f} s a fit, "
                f"{np.median([r['iterations'] for r in rows]):.0f} iterations, "
                f"{sum(not r['solved'] for r in rows)} not solved, marker error "
                f"{np.median([r['marker_sd_mm'] for r in rows]):.2f} mm per axis"
            )


def main() -> None:
    """Print one table a condition."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20, help="how many subjects")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--quick", action="store_true", help="1 subject, 1.5 s a point")
    parser.add_argument("--only", type=int, help="only this condition, from 0")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    n, seconds = (1, 1.5) if options.quick else (options.seeds, 3.0)
    seeds = range(options.first, options.first + n)
    about = {
        "simulated": True,
        "seeds": [seeds[0], seeds[-1]],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "casadi": casadi.__version__,
        "machine": platform.machine(),
        "cores": os.cpu_count(),
    }
    people = {
        condition: [subject(seed, seconds=seconds, **settings) for seed in seeds]
        for i, (condition, settings) in enumerate(CONDITIONS.items())
        if options.only in (None, i) and (i > 0 or not options.quick)
    }
    if options.json:
        print(json.dumps({"about": about, "conditions": people}))
        return
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    for condition, rows in people.items():
        print_table(condition, rows)


if __name__ == "__main__":
    main()
