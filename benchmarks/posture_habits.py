"""Do simulated people turn the elbow with the hand as real ones do? Side by side.

Real: reaches of UE_ADL, both arms of seven people. Simulated: people of
`ikns.simulation` with habits and without, who reach from and to hand poses drawn from
the real reaches' distribution, four tasks of three repeats each. Both are measured by
the same steps: the change per reach of the hinge swivel (nothing learned), and of the
paper's c, whose ten places lie where the hand went in the other repeats; in units of
the explored range of 70 deg.

- without habits: one swivel everywhere, 3 deg of scatter; hands as of the others;
- habits, no rough field: the quadratic and 1.9 deg from rest to rest alone.
"""

import argparse
import dataclasses
import json
import platform
from pathlib import Path

import numpy as np
from null_space.methods import METHODS
from null_space.people import Arm, ArmTrial, real_arms
from null_space.scores import of_people, summary
from scipy.spatial.transform import Rotation

from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.simulation import virtual_subject
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual import habitual_posture
from ikns.simulation.habitual_places import reach_by_joints
from ikns.simulation.places import Place, place_of
from ikns.simulation.posture_habits import (
    PostureHabits,
    draw_posture_habits,
    draw_reaches,
)
from ikns.simulation.protocol_body import RESTING, both_arms

Array = np.ndarray
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
RATE, CHAIN = 100.0, "right_arm"
TASKS, REPEATS = "FADC", (1, 2, 3)
#: How repeats of a task differ, m and rad a axis.
AGAIN, TURNED = 0.01, np.radians(4.0)
#: A reach is of 0.10 m or more; up to this many draws until one can be done.
FAR, TRIES = 0.10, 100
#: A swivel of one who holds one posture everywhere, and its scatter, rad.
TAME, SCATTER = np.radians(50.0), np.radians(3.0)
#: What simulated people were asked to come near: the real figure, give or take.
WITHIN = 0.2
MEASURES = {"hinge swivel": "hinge swivel", "paper's c": "paper"}


def tame(person: int) -> PostureHabits:
    """Draw one who holds one posture everywhere."""
    mean = np.random.default_rng([41, person]).normal(TAME, np.radians(6.0))
    return PostureHabits(
        np.r_[mean, np.zeros(27)], np.zeros((1, 6)), np.zeros(1), 0.0, SCATTER
    )


def smooth(person: int) -> PostureHabits:
    """Draw one with the quadratic alone."""
    return dataclasses.replace(draw_posture_habits(person), rough=0.0)


KINDS = {
    "simulated, habits": draw_posture_habits,
    "simulated, habits, no rough field": smooth,
    "simulated, no habits": tame,
}


def simulated_arm(person: int, habits: PostureHabits) -> Arm:
    """One simulated person's right arm and its reaches."""
    rng = np.random.default_rng([42, person])
    arm = ArmKinematics(virtual_subject(person).skeleton, "right")
    sitting = both_arms(arm.skeleton, RESTING)
    lengths = arm.skeleton.segment_lengths
    size = lengths["right_upper_arm"] + lengths["right_forearm"]
    wrist, hand = arm.skeleton.link_in_thorax(sitting, "right_hand")
    along = hand.T @ (arm.hand(sitting)[0] - wrist)

    def held(place: Array, rotation: Array) -> Place:
        again = Rotation.from_rotvec(TURNED * rng.normal(size=3)).as_matrix()
        rotation = again @ rotation
        knuckle = arm.shoulder(sitting) + size * place + rotation @ along
        posture = habitual_posture(
            arm,
            sitting,
            knuckle + AGAIN * rng.normal(size=3),
            rotation,
            habits=habits,
            scatter=rng.normal(0.0, habits.rest),
            girdle_rest=np.zeros(2),
        )
        return place_of(arm, sitting, posture)

    trials: list[ArmTrial] = []
    for task in TASKS:
        for _ in range(TRIES):
            (wrists,), (rotations,) = draw_reaches(rng, 1)
            try:
                made = [
                    [held(*end) for end in zip(wrists, rotations, strict=True)]
                    for _ in REPEATS
                ]
            except InvalidInput:
                continue
            if all(np.linalg.norm(b.position - a.position) >= FAR for a, b in made):
                break
        trials += [
            _trial(arm, sitting, task, repeat, *ends)
            for repeat, ends in zip(REPEATS, made, strict=True)
        ]
    return Arm(f"simulated {person}", "right", arm.skeleton, tuple(trials))


def _trial(
    arm: ArmKinematics, sitting: Array, task: str, repeat: int, a: Place, b: Place
) -> ArmTrial:
    """There and back, with half a second of rest at either end."""
    rest = [np.tile(end.posture, (50, 1)) for end in (a, b)]
    n = max(40, round(RATE * (0.6 + 1.2 * np.linalg.norm(b.position - a.position))))
    out, back = (
        reach_by_joints(arm, sitting, *pair, n=n).postures for pair in ((a, b), (b, a))
    )
    angles = np.tile(sitting, (150 + 2 * n, 1))
    angles[:, arm.columns] = np.concatenate([rest[0], out, rest[1], back, rest[0]])
    wrist, swivel = arm_swivel(arm.skeleton, angles, CHAIN)
    hand = arm.hand(angles)[0]
    speed = np.linalg.norm(np.gradient(hand, 1 / RATE, axis=0), axis=1)
    time = np.arange(len(angles)) / RATE
    return ArmTrial(task, repeat, time, wrist, hand, speed, swivel, angles)


def measured(arms: list[Arm]) -> dict[str, dict]:
    """Return changes per reach by measure."""
    nobody = {arm.person: np.zeros(10) for arm in arms}
    return {
        words: summary(of_people(arms, nobody, METHODS[method], "same"))
        for words, method in MEASURES.items()
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--people", type=int, default=20, help="simulated ones")
    parser.add_argument("--quick", action="store_true", help="one real, one simulated")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    arms = real_arms(options.data / "ue_adl", people=1 if options.quick else None)
    people = range(1 if options.quick else options.people)
    table = {"real": measured(arms)}
    for kind, draw in KINDS.items():
        table[kind] = measured([simulated_arm(k, draw(k)) for k in people])
    if options.json:
        print(json.dumps(table, indent=1))
        return
    print(
        f"{len({arm.person for arm in arms})} real people, both arms; {len(people)} "
        f"simulated ones a row, seeds from 0. numpy {np.__version__}, Python "
        f"{platform.python_version()}.\n"
    )
    print("| people | measure | reaches | change | > 0.2 | people, 10, 50, 90 % |")
    print("|---|---|---|---|---|---|")
    for kind, rows in table.items():
        for words, row in rows.items():
            spread = ", ".join(
                f"{x:.3f}" for x in np.percentile(row["people"], [10, 50, 90])
            )
            print(
                f"| {kind} | {words} | {row['reaches']} | {row['change']:.3f} "
                f"| {row['above_0.2']:.0%} | {spread} |"
            )
    for words in MEASURES:
        real, made = (table[k][words]["change"] for k in ("real", "simulated, habits"))
        word = "within" if abs(made / real - 1) <= WITHIN else "NOT WITHIN"
        print(f"\n{words}: simulated {made:.3f}, real {real:.3f}: {word} 20 %")


if __name__ == "__main__":
    main()
