"""Uncontrolled manifold of reaching: what real recordings support, and a known truth.

1. Real people (UE_ADL, two persons, both arms, four tasks, **one** trial each).
   Variance over trials needs trials: asked for it, the library says how many. One trial
   does support two things. *Self-motion*: how much of the joint velocity over the
   movement leaves the hand in place (Scholz et al. 2011, Exp Brain Res 209:319), beside
   all 64 ways of turning single joints' velocities around, which keep how fast each
   moves. *Rests*: variance over a hand at rest, beside what camera noise alone makes of
   a body that does not move.
2. Virtual subjects (simulated) repeat a reach. Elbow and hand vary by known amounts,
   planted as swivel angles and hand positions; the truth is split with differences of
   the forward kinematics. Then cameras, skin, scaling and marker inverse kinematics
   come in between.
"""

import argparse
import json
import platform
import time
from pathlib import Path

import numpy as np
from uncontrolled.real import real_people
from uncontrolled.simulated import APART, STEADY, virtual_person

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"


def print_real(rows: list[dict], sentence: str) -> None:
    """Print both tables of real people."""
    print("## Real people, one trial each\n")
    print(f"Variance over trials is refused: {sentence}\n")
    print(
        "| person | task, side | movement s | null share of velocity | index "
        "| mean of 64 turned | rank of 64 |"
    )
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row['person']} | {row['task']}, {row['side']} | {row['seconds']:.2f} "
            f"| {row['null_share']:.2f} | {row['index']:+.2f} "
            f"| {row['index_turned']:+.2f} | {row['rank']} |"
        )
    print("\nRests, variance per degree of freedom in deg2; dVz with zero offset\n")
    print(
        "| person | task, side | samples | V_UCM | V_ORT | of noise alone "
        "| dVz (95 %) | of noise alone | p |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        rest = row["rest"]
        if "p" not in rest:
            continue
        low, high = rest["interval"]
        print(
            f"| {row['person']} | {row['task']}, {row['side']} | {rest['samples']} "
            f"| {rest['v_ucm_deg2']:.3f} | {rest['v_ort_deg2']:.3f} "
            f"| {rest['noise_v_ucm_deg2']:.3f}, {rest['noise_v_ort_deg2']:.3f} "
            f"| {rest['delta_vz']:+.2f} ({low:+.2f} to {high:+.2f}) "
            f"| {rest['noise_delta_vz']:+.2f} | {rest['p']:.3f} |"
        )


def print_virtual(rows: list[dict], n_trials: int) -> None:
    """Print the table of virtual subjects, means over them."""
    people = len({row["seed"] for row in rows})
    print(
        f"\n## Virtual subjects (simulated), {people} of them, {n_trials} trials each, "
        "hand position over normalized time\n"
    )
    print(
        "| condition | skin mm | V_UCM true, found | V_ORT true, found "
        "| dVz true, found | worst error | joints shuffled | p < 0.05 |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for (name, skin), group in groups(rows).items():
        mean = {
            key: np.mean([row[key] for row in group])
            for key in group[0]
            if key not in ("seed", "condition", "interval")
        }
        worst = max(abs(row["delta_vz"] - row["true_delta_vz"]) for row in group)
        print(
            f"| {name} | {skin:.0f} "
            f"| {mean['true_v_ucm_deg2']:.2f}, {mean['v_ucm_deg2']:.2f} "
            f"| {mean['true_v_ort_deg2']:.2f}, {mean['v_ort_deg2']:.2f} "
            f"| {mean['true_delta_vz']:+.2f}, {mean['delta_vz']:+.2f} | {worst:.2f} "
            f"| {mean['surrogates']:+.2f} | {few(group)} of {people} |"
        )


def groups(rows: list[dict]) -> dict[tuple[str, float], list[dict]]:
    """Rows of virtual subjects by condition and skin."""
    found: dict[tuple[str, float], list[dict]] = {}
    for row in rows:
        found.setdefault((row["condition"], row["skin_mm"]), []).append(row)
    return found


def few(rows: list[dict]) -> int:
    """How many have a p below 0.05."""
    return sum(row["p"] < 0.05 for row in rows)


def print_conclusion(real: list[dict], virtual: list[dict]) -> None:
    """Say in words what the tables show."""
    print("\n## What follows\n")
    if real:
        rests = [row["rest"] for row in real if "p" in row["rest"]]
        turned = sum(row["rank"] <= 0.05 * row["patterns"] for row in real)
        positive = sum(rest["delta_vz"] > 0 for rest in rests)
        of_noise = sum(rest["noise_delta_vz"] > 0 for rest in rests)
        print(
            "- Real people: no synergy over trials can be claimed from these files. "
            f"Self-motion beyond what the joints' speeds make likely (5 %): {turned} "
            f"of {len(real)} movements. At rest V_UCM exceeds V_ORT in {positive} of "
            f"{len(rests)}, but so it does for camera noise alone ({of_noise}); joints "
            f"covary (p < 0.05) in {few(rests)}, and an arm on a table need not be "
            "controlled for that."
        )
    by = groups(virtual)
    apart = [row for (name, _), rows in by.items() if name == APART for row in rows]
    noise = [row for (name, _), rows in by.items() if name == STEADY for row in rows]
    largest = max(row["v_ucm_deg2"] for row in noise)
    print(
        "- Simulated: with independent joints dVz (zero offset) is "
        f"{np.mean([row['delta_vz'] for row in apart]):+.2f} on average, so V_UCM > "
        f"V_ORT alone shows no coordination; shuffling says so (p < 0.05 in "
        f"{few(apart)} of {len(apart)}).\n"
        "- Simulated: where nothing varies, noise, skin and cutting pass for a synergy "
        f"(p < 0.05 in {few(noise)} of {len(noise)}) of V_UCM up to {largest:.2f} "
        "deg2: hold V_UCM against this floor before believing p."
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="fewer trials")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    start = time.perf_counter()
    folder = options.data / "ue_adl"
    real, sentence = [], f"no recordings at {folder}."
    if folder.is_dir():
        real, sentence = real_people(folder, quick=options.quick, seed=options.seed)
    n_trials, people = (10, 1) if options.quick else (25, 5)
    virtual = [
        row
        for seed in range(options.seed, options.seed + people)
        for row in virtual_person(seed, n_trials=n_trials, quick=options.quick)
    ]
    if options.json:
        found = {"real": real, "sentence": sentence, "simulated": virtual}
        print(json.dumps(found, default=float))
        return
    print(
        f"numpy {np.__version__}, Python {platform.python_version()}, "
        f"{platform.machine()}, seed {options.seed}, "
        f"{time.perf_counter() - start:.0f} s\n"
    )
    print_real(real, sentence)
    print_virtual(virtual, n_trials)
    print_conclusion(real, virtual)


if __name__ == "__main__":
    main()
