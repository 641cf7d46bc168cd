"""Is a person found whose joints are not the model's? Bodies of another making.

The bodies and their movements come from tests/other_body.py, plain numpy that shares no
code with the package: carrying angles from 0 to 20 deg, other axes at elbow, forearm
and wrist, axes that do not meet, other lengths, girths and marker places. Each gives a
static trial and ten held points to `calibrate`, which is asked for the direction at
each point (against the null space of the true arm), and for lengths with spreads: of
the static trial alone, and of static trial and points together.

One marker on the hand shows no axis of the wrist: whatever these are off turns wrist
flexion and deviation into each other. So the table is printed with wrist axes off by 0
and by 3 deg (standard deviation about either of two directions).
"""

import argparse
import json
import platform
import sys
import time
import warnings
from pathlib import Path

import numpy as np

from ikns.calibration import calibrate
from ikns.recording.recording import Recording

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
import other_body

RATE = 50.0
#: Standing, arms hanging, rad.
STANDING = np.radians([10, 3, 0, 12, 5, 2, 0])
WRISTS = (0.0, 3.0)


def person(seed: int, wrist_sd: float, noise: float, skin: float) -> dict[str, object]:
    """Every figure of one body."""
    body = other_body.draw_person(seed, wrist_sd=wrist_sd)
    rng = np.random.default_rng([22, seed])
    q, point, truth = other_body.exploration(body, rate=RATE, seed=seed)
    calm = np.tile(STANDING, (75, 1))
    recordings = []
    for name, angles in (("static", calm), ("points", q)):
        markers, labels = other_body.recorded(body, angles, rng, noise)
        if skin and name == "points":
            # Skin that goes with the posture: linear in the angles, random per marker.
            gain = np.random.default_rng([23, seed]).normal(size=(7, *markers[0].shape))
            moved = np.tensordot(angles - STANDING, gain, axes=1)
            markers += skin * moved / np.sqrt(np.mean(np.sum(moved**2, axis=2)))
        time_s = np.arange(len(angles)) / RATE
        recordings.append(
            Recording(time_s, markers, tuple(labels), f"{name}, simulated")
        )
    started = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = calibrate(recordings[0], recordings[1:], n_points=len(truth))
    spent = time.perf_counter() - started
    learned, (motion,) = found.null_space_map, found.motions
    hand = motion.task_position("right_arm")
    off = []
    for k, n in enumerate(truth):
        here = np.median(hand[point == k], axis=0)
        nearest = np.linalg.norm(learned.centers_ - here, axis=1).argmin()
        Z = learned.directions_[nearest, 0]
        off.append(float(np.degrees(np.arccos(min(1.0, abs(Z @ n))))))
    row: dict[str, object] = {
        "seed": seed,
        "carrying_deg": float(np.degrees(body.right.carrying)),
        "direction_deg": sorted(off),
        "fitted": found.report.get("body") is not None,
        "seconds": spent,
    }
    both = found.report.get("body") or found.report["static"]
    for part, true in other_body.lengths(body.right).items():
        for kind, report in (("static", found.report["static"]), ("both", both)):
            row[f"{part}_{kind}_mm"] = [
                1000 * (report["lengths_m"][f"right_{part}"] - true),
                1000 * report["length_sd_m"][f"right_{part}"],
            ]
    return row


def table(rows: list[dict]) -> None:
    """Print directions and lengths of all bodies of one kind."""
    n = len(rows)
    angles = np.array([row["direction_deg"] for row in rows])
    print("| direction off by, deg | median | worst body | at most 6 deg |")
    print("|---|---|---|---|")
    for name, column in (("median point", 4), ("9th of 10", 8), ("worst point", 9)):
        values = angles[:, column]
        print(
            f"| {name} | {np.median(values):.1f} | {values.max():.1f} "
            f"| {np.sum(values <= 6)} of {n} |"
        )
    print(
        "\n| length | from | rms mm | worst | stated sd | in 5 mm | in 95 % interval |"
    )
    print("|---|---|---|---|---|---|---|")
    for part in ("upper_arm", "forearm", "hand"):
        for kind in ("static", "both"):
            error, sd = np.array([row[f"{part}_{kind}_mm"] for row in rows]).T
            print(
                f"| {part} | {kind} | {np.sqrt(np.mean(error**2)):.1f} "
                f"| {np.abs(error).max():.1f} | {np.median(sd):.1f} "
                f"| {np.sum(np.abs(error) <= 5)} of {n} "
                f"| {np.sum(np.abs(error) <= 1.96 * sd)} of {n} |"
            )
    spent = np.median([row["seconds"] for row in rows])
    fitted = sum(row["fitted"] for row in rows)
    print(f"\nfitted to the points: {fitted} of {n}; calibration {spent:.1f} s a body")


def main() -> None:
    """Print one table a kind of wrist."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=20)
    parser.add_argument("--noise", type=float, default=1e-3, help="of markers, m")
    parser.add_argument("--skin", type=float, default=0.0, help="its motion, rms, m")
    parser.add_argument("--quick", action="store_true", help="one body")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    seeds = range(1 if options.quick else options.bodies)
    result = {
        f"wrist axes off by {wrist:g} deg": [
            person(seed, wrist, options.noise, options.skin) for seed in seeds
        ]
        for wrist in WRISTS
    }
    if options.json:
        print(json.dumps({"simulated": True, **result}))
        return
    print(
        f"Everything here is simulated: noise {1000 * options.noise:g} mm, skin "
        f"{1000 * options.skin:g} mm, seeds 0 to {len(seeds) - 1}, numpy "
        f"{np.__version__}, Python {platform.python_version()}"
    )
    for kind, rows in result.items():
        print(f"\n{kind}, {len(rows)} bodies\n")
        table(rows)


if __name__ == "__main__":
    main()
