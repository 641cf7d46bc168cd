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
import itertools
import json
import platform
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from ikns.calibration import track_chain
from ikns.errors import NotEnoughData
from ikns.files import read
from ikns.marker_ik import MarkerIK
from ikns.motion import SIDES, Motion, chain_joints
from ikns.nullspace_map import still
from ikns.recording import Recording
from ikns.scaling import scale
from ikns.simulation import Unsteadiness, simulate_protocol, virtual_subject
from ikns.simulation.arm import Arm
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.movement import carry_out, reach
from ikns.simulation.places import Place, explored_places
from ikns.simulation.trial import film, place_in_room, true_motion
from ikns.skeleton import Skeleton
from ikns.subspace import null_projector
from ikns.ucm import (
    VarianceSplit,
    across_trials,
    aligned_angles,
    confidence_interval,
    movement,
    numerical_task,
    surrogate_test,
    variance_split,
    within_trial,
)

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
TASKS = {"F": "reach forward", "A": "reach across", "D": "drink", "C": "comb hair"}
#: Of the simulated reaches: spread of the elbow and of the hand over trials.
SWIVEL_SD, HAND_SD, WIDE_HAND_SD = np.radians(8.0), 5e-3, 20e-3
NOISE, SKIN = 1e-3, 5e-3
DEG2 = np.degrees(1.0) ** 2
STEADY = "nothing varies but the pace"
APART = "same spread, joints independent"

# --- real people --------------------------------------------------------------------


def self_motion_index(skeleton: Skeleton, motion: Motion, chain: str) -> dict:
    """Joint velocity along the null space over that across it, per joint (log / 2)."""
    cut = movement(motion.time, motion.hand_speed(chain))
    velocity = motion.chain_velocities(chain)[cut]
    J = skeleton.chain_jacobian(motion.angles[cut], chain, task="position")
    k, n = J.shape[-2:]
    known = np.isfinite(velocity).all(axis=1)
    outer = velocity[known][:, :, None] * velocity[known][:, None, :]
    # Turning joints around by signs s only changes which products count how.
    products = np.sum(null_projector(J[known]) * outer, axis=0)
    whole = float(np.sum(velocity[known] ** 2))
    signs = np.array([(1, *s) for s in itertools.product((1, -1), repeat=n - 1)])
    null = np.einsum("si,ij,sj->s", signs, products, signs)
    index = np.log((null / (n - k)) / ((whole - null) / k)) / 2
    return {
        "seconds": float(np.ptp(motion.time[cut])),
        "null_share": null[0] / whole,
        "index": index[0],
        "index_turned": index.mean(),
        "rank": int(np.sum(index >= index[0] - 1e-12)),
        "patterns": len(signs),
    }


def longest_rest(motion: Motion, chain: str) -> np.ndarray:
    """Longest time with the hand at rest, as which samples."""
    gate = still(motion, chain, min_duration=0.5)
    edges = np.flatnonzero(np.diff(np.r_[False, gate, False])).reshape(-1, 2)
    rows = np.zeros(len(gate), dtype=bool)
    if len(edges):
        rows[slice(*edges[np.argmax(edges[:, 1] - edges[:, 0])])] = True
    return rows


def noise_alone(
    skeleton: Skeleton,
    motion: Motion,
    recording: Recording,
    rows: np.ndarray,
    seed: int,
) -> Motion:
    """Track a body that does not move, with the camera noise of these frames.

    White noise of a marker makes second differences of sqrt(6) times its size.
    """
    worn = skeleton.marker_set
    seen = worn.pick(recording.labels, recording.markers)[rows]
    sd = np.nan_to_num(np.nanstd(np.diff(seen, 2, axis=0), axis=0) / np.sqrt(6))
    body = motion.q[np.flatnonzero(rows)[rows.sum() // 2]]
    noise = sd * np.random.default_rng(seed).normal(size=seen.shape)
    markers = skeleton.markers_in_world(body) + noise
    stood = Recording(recording.time[rows], markers, worn.labels, "noise alone")
    return MarkerIK(skeleton).track(stood)


def rest_row(skeleton, motion, recording, chain, *, seed, n_surrogates) -> dict:
    """Variance over the longest rest, and that of noise alone."""
    rows = longest_rest(motion, chain)
    if rows.sum() <= len(chain_joints(chain)):
        return {"samples": int(rows.sum())}
    split = within_trial(skeleton, motion, rows, chain=chain)
    test = surrogate_test(split, by="shift", n_surrogates=n_surrogates, seed=seed)
    interval = confidence_interval(split, method="bootstrap", seed=seed)
    noise = noise_alone(skeleton, motion, recording, rows, seed)
    floor = within_trial(skeleton, noise, np.ones(rows.sum(), bool), chain=chain)
    return {
        "samples": int(rows.sum()),
        "v_ucm_deg2": DEG2 * split.v_ucm,
        "v_ort_deg2": DEG2 * split.v_ort,
        "noise_v_ucm_deg2": DEG2 * floor.v_ucm,
        "noise_v_ort_deg2": DEG2 * floor.v_ort,
        "delta_vz": split.delta_vz_corrected,
        "interval": [
            end - split.delta_vz + split.delta_vz_corrected
            for end in (interval.low, interval.high)
        ],
        "noise_delta_vz": floor.delta_vz_corrected,
        "p": test.p,
    }


def real_people(folder: Path, *, quick: bool, seed: int) -> tuple[list[dict], str]:
    """One row a recording, and what the library says to variance over trials."""
    rows, sentence = [], ""
    for name in ("ADL001", "ADL005"):
        static = read(folder / name / f"{name}_static.csv")
        # One of the two static trials lasts 0.41 s.
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3
        )
        for task, side in itertools.product(TASKS, SIDES):
            if quick and (task, side) not in (("F", "right"), ("C", "left")):
                continue
            recording = read(folder / name / f"{name}{task}{side[0].upper()}1.csv")
            chain = f"{side}_arm"
            motion = track_chain(skeleton, recording, chain)
            try:
                across_trials(skeleton, [motion], chain=chain)
            except NotEnoughData as error:
                sentence = str(error)
            rows.append(
                {"person": name, "task": TASKS[task], "side": side}
                | self_motion_index(skeleton, motion, chain)
                | {
                    "rest": rest_row(
                        skeleton,
                        motion,
                        recording,
                        chain,
                        seed=seed,
                        n_surrogates=199 if quick else 999,
                    )
                }
            )
    return rows, sentence


# --- a virtual subject --------------------------------------------------------------


class Reaches:
    """A simulated person who repeats one reach in several ways."""

    def __init__(self, seed: int, *, n_trials: int, rate: float) -> None:
        self.seed, self.n_trials, self.rate = seed, n_trials, rate
        self.run = simulate_protocol(
            virtual_subject(seed), seed=seed, n_points=4, quick=True, rate=rate
        )
        person = self.run.subject.skeleton
        self.arm = Arm(person, "right")
        self.measured, _ = scale(Skeleton.load(), self.run.static.recording)
        self.sitting = self.run.points.truth.angles[0]
        self.places = explored_places(
            self.arm,
            self.sitting,
            self.run.places[[0, 3]],
            rng=np.random.default_rng(seed),
            girdle_rest=self.sitting[self.arm.columns[:2]],
            girdle_follow=0.0,
        )

    def moved(self, swivel: np.ndarray, hand: np.ndarray) -> list[np.ndarray]:
        """Joint angles of each trial, (T, 18): elbow and hand off by so much."""
        trials = []
        for i in range(self.n_trials):
            ends = [
                self._off(p, swivel[i], hand[i, j]) for j, p in enumerate(self.places)
            ]
            n = round(self.rate * (0.9 + 0.2 * i / self.n_trials))
            plan = reach(*ends, n=n)
            body = np.repeat(self.sitting[None], n, axis=0)
            still_hand = Unsteadiness(drift=0.0, tilt=0.0, tremor=0.0, tremor_tilt=0.0)
            trials.append(
                carry_out(
                    self.arm,
                    body,
                    plan,
                    unsteadiness=still_hand,
                    rate=self.rate,
                    rng=np.random.default_rng(0),
                )
            )
        return trials

    def _off(self, place: Place, swivel: float, hand: np.ndarray) -> Place:
        low, high = place.motion.swivel[[0, -1]]
        posture = place.motion.at(np.clip(place.swivel + swivel, low, high))
        return replace(place, posture=posture, position=place.position + hand)

    def filmed(
        self, trials: list[np.ndarray], *, skin: float
    ) -> tuple[list[Motion], list[Motion]]:
        """Truth, and what comes out behind cameras and inverse kinematics."""
        rng = np.random.default_rng(self.seed)
        tissue = None
        if skin:
            tissue = SoftTissue(
                self.arm.skeleton,
                skin,
                reference=self.run.static.truth.angles.mean(axis=0),
                angles=self.run.points.truth.angles,
                rng=rng,
            )
        truth, found = [], []
        for angles in trials:
            # Half a second of rest before and after, as recordings have.
            rest = round(self.rate / 2)
            angles = np.pad(angles, ((rest, rest), (0, 0)), mode="edge")
            q = place_in_room(
                angles,
                height=1.0,
                heading=0.5,
                sway=(2e-3, np.radians(0.3)),
                rate=self.rate,
                rng=rng,
            )
            trial = film(
                [self.arm],
                q,
                name="reach",
                point=np.full(len(q), -1),
                with_static_only=False,
                noise=NOISE,
                skin=tissue,
                occluded=0.0,
                rate=self.rate,
                rng=rng,
            )
            time_s = np.arange(len(q)) / self.rate
            truth.append(true_motion(self.arm.skeleton, time_s, q))
            found.append(track_chain(self.measured, trial.recording, "right_arm"))
        return truth, found

    def true_split(self, truth: list[Motion]) -> VarianceSplit:
        """Split of the true angles; the Jacobian comes from differences of the hand."""
        skeleton = self.arm.skeleton
        angles = aligned_angles(truth, "right_arm")
        columns = [
            skeleton.joint_names.index(joint) for joint in chain_joints("right_arm")
        ]
        mean = angles.mean(axis=0)

        def hand(q: np.ndarray) -> np.ndarray:
            # Axes: time, which joint is moved, joint.
            body = np.array(np.broadcast_to(mean[:, None], (*q.shape[:-1], 18)))
            body[..., columns] = q
            return skeleton.hands_in_thorax(body)[0][..., 0, :]

        return variance_split(angles[..., columns], numerical_task(hand))

    def conditions(self) -> dict[str, list[np.ndarray]]:
        """Trials by how they vary."""
        rng = np.random.default_rng(self.seed)
        n = self.n_trials
        swivel = SWIVEL_SD * rng.normal(size=n)
        hand = HAND_SD * rng.normal(size=(n, 2, 3))
        nothing = np.zeros(n), np.zeros((n, 2, 3))
        steady = self.moved(*nothing)
        elbow = self.moved(swivel, hand)
        columns = self.arm.columns[2:]
        spread = np.std([trial[len(trial) // 2, columns] for trial in elbow], axis=0)
        apart = [trial.copy() for trial in steady]
        for trial in apart:
            trial[:, columns] += spread * rng.normal(size=len(columns))
        wide = WIDE_HAND_SD * rng.normal(size=(n, 2, 3))
        return {
            "elbow varies, hand kept": elbow,
            APART: apart,
            "hand varies, elbow kept": self.moved(nothing[0], wide),
            STEADY: steady,
        }


def virtual_person(seed: int, *, n_trials: int, quick: bool) -> list[dict]:
    """One row a condition, all simulated."""
    reaches = Reaches(seed, n_trials=n_trials, rate=50 if quick else 100)
    rows = []
    for name, trials in reaches.conditions().items():
        for skin in (0.0,) if quick else (0.0, SKIN):
            truth, found = reaches.filmed(trials, skin=skin)
            split = across_trials(reaches.measured, found)
            test = surrogate_test(split, n_surrogates=199 if quick else 999, seed=seed)
            interval = confidence_interval(split, overall=True)
            shift = split.delta_vz_corrected[50] - split.delta_vz[50]
            true = reaches.true_split(truth)
            rows.append(
                {
                    "seed": seed,
                    "condition": name,
                    "skin_mm": 1000 * skin,
                    "true_v_ucm_deg2": DEG2 * true.v_ucm.mean(),
                    "true_v_ort_deg2": DEG2 * true.v_ort.mean(),
                    "true_delta_vz": true.delta_vz_corrected.mean(),
                    "v_ucm_deg2": DEG2 * split.v_ucm.mean(),
                    "v_ort_deg2": DEG2 * split.v_ort.mean(),
                    "delta_vz": interval.estimate + shift,
                    "interval": [interval.low + shift, interval.high + shift],
                    "surrogates": test.mean.mean() + shift,
                    "p": test.p_overall,
                }
            )
    return rows


# --- words --------------------------------------------------------------------------


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
