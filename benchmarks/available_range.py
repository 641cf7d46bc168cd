"""How much of what the arm can do at a held hand is used? Virtual subjects, one table.

At every PCA point the learned direction Z has a used range, m to M, and an available
one: least and greatest Z q over all postures that hold the hand within the joint limits
and keep arm and trunk apart (IPOPT on the symbolic kinematics). The simulated people
explore by an assumption (30 to 40 deg of elbow swivel to either side, 5 deg off every
limit), so the share they use is an input and not a finding about people; what is
available, and what ends it, follows from the body. Z is learned from the true angles.
"""

import argparse
import json
import os
import platform
import time
import warnings
from collections import Counter

import casadi
import numpy as np

from ikns.body.chains import chain_joints
from ikns.calibration import elbow_reference
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap, null_space_samples
from ikns.nullspace.map.samples import still_mask
from ikns.simulation import simulate_protocol, virtual_subject
from ikns.symbolic import HeldHand

CHAIN = "right_arm"
#: What is held, by which joints, and what may not be touched.
HOLDS = {
    "pose, limits alone": (CHAIN, "pose", ()),
    "pose": (CHAIN, "pose", None),
    "pose, with the clavicle": (f"{CHAIN}_clavicle", "pose", None),
    "position": (CHAIN, "position", None),
}


def subject(seed: int, *, seconds: float, every: int) -> dict:
    """Return used and available ranges of one simulated subject, point by point."""
    person = virtual_subject(seed)
    run = simulate_protocol(
        person,
        seed=seed,
        free_seconds=0.1,
        point_seconds=seconds,
        rate=50,
    )
    body, truth = person.skeleton, run.points.truth
    x, q = null_space_samples(truth, chain=CHAIN)
    gate = np.flatnonzero(still_mask(truth, CHAIN))
    reference = elbow_reference(body, truth.q.mean(axis=0), CHAIN)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        learned = NullSpaceMap(len(run.places), reference=reference).fit(x, q)
    hands = {
        name: HeldHand(body, chain, task=task, pairs=pairs)
        for name, (chain, task, pairs) in HOLDS.items()
    }
    rows = []
    for k in range(0, len(learned.centers_), every):
        Z = learned.directions_[k, 0]
        own = np.flatnonzero(learned.labels_ == k)
        middle = np.linalg.norm(q[own] - learned.cluster_means_[k], axis=1).argmin()
        posture = truth.q[gate[own[middle]]]
        row = {
            "used": float(learned.upper_[k, 0] - learned.lower_[k, 0]),
            "swivel_used": float(np.ptp(run.points.swivel[gate[own]])),
        }
        for name, hand in hands.items():
            n = len(hand.chain.columns)
            started = time.perf_counter()
            try:
                found = hand.range(posture, np.r_[np.zeros(n - 7), Z])
            except InvalidInput as error:
                row[name] = {"refused": str(error)}
                continue
            row[name] = {
                "lower": found.lower,
                "upper": found.upper,
                "below": float(learned.lower_[k, 0]) - found.lower,
                "above": found.upper - float(learned.upper_[k, 0]),
                "stops": found.stops,
                "solved": found.solved,
                "ms": 1000 * (time.perf_counter() - started),
            }
            if name == "pose":
                sweep = hand.sweep(posture, direction=Z)
                ends = np.tile(posture, (2, 1))
                ends[:, body.columns(chain_joints(CHAIN)) + 1] = sweep.postures[[0, -1]]
                turn = np.diff(np.unwrap(body.swivel(ends)[:, 0]))
                row["swivel_available"] = float(abs(turn[0]))
                row["sweep_solved"] = sweep.solved
        rows.append(row)
    return {"seed": seed, "points": rows}


def spread(values: list[float], scale: float = 1.0) -> str:
    """Median and the ends of a list."""
    array = scale * np.array(values)
    return f"{np.median(array):.3g} ({array.min():.3g} to {array.max():.3g})"


def print_tables(people: list[dict]) -> None:
    """Ranges, then what ends them."""
    points = [row for person in people for row in person["points"]]
    print(
        f"\nsimulated: {len(people)} subjects, {len(points)} PCA points, 7 joints, "
        "median (least to greatest) over the points\n"
    )
    print("| what is held | available, rad | share used, % | beyond m | beyond M |")
    print("|---|---|---|---|---|")
    used = [row["used"] for row in points]
    print(f"| used: M - m | {spread(used)} | | | |")
    for name in HOLDS:
        good = [row for row in points if "lower" in row[name]]
        wide = [row[name]["upper"] - row[name]["lower"] for row in good]
        share = [row["used"] / w for row, w in zip(good, wide, strict=True)]
        below, above = (
            [row[name][side] for row in good] for side in ("below", "above")
        )
        print(
            f"| {name} | {spread(wide)} | {spread(share, 100)} | {spread(below)} "
            f"| {spread(above)} |"
        )
    used = [np.degrees(row["swivel_used"]) for row in points]
    free = [
        np.degrees(row["swivel_available"])
        for row in points
        if "swivel_available" in row
    ]
    print(f"\nelbow swivel, deg: used {spread(used)}, available {spread(free)}")
    for name in HOLDS:
        good = [row[name] for row in points if "lower" in row[name]]
        refused = len(points) - len(good)
        missed = sum(not ok for row in good for ok in row["solved"])
        print(
            f"\n{name}: {np.median([row['ms'] for row in good]):.0f} ms a range, "
            f"{missed} of {2 * len(good)} ends not solved, {refused} points refused"
        )
        for end, what in enumerate(("lower", "upper")):
            stops = Counter(stop for row in good for stop in row["stops"][end])
            common = ", ".join(f"{s} {n}" for s, n in stops.most_common(4))
            print(f"  {what} end: {common}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="how many subjects")
    parser.add_argument("--quick", action="store_true", help="1 subject, 5 points")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    seeds = range(1 if options.quick else options.seeds)
    seconds, every = (2.0, 2) if options.quick else (5.0, 1)
    people = [subject(seed, seconds=seconds, every=every) for seed in seeds]
    about = {
        "simulated": True,
        "seeds": [seeds[0], seeds[-1]],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "casadi": casadi.__version__,
        "machine": platform.machine(),
        "cores": os.cpu_count(),
    }
    if options.json:
        print(json.dumps({"about": about, "subjects": people}))
        return
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    print_tables(people)


if __name__ == "__main__":
    main()
