r"""How the people of UE_ADL hold their arms, for simulated people: a small TOML file.

Swivels: each arm's hinge swivel in moving frames is fitted with a quadratic in wrist
center and long axis of the hand (28 terms). All arms together give one field; each
arm's own departure from it has a ridge of 0.01, with which arms drawn from the mean and
covariance change their swivel from rest to rest about as much as the real ones. When
real arms had 0.117 of the range a reach, drawn ones had 0.183 with a ridge of 0.001
(what is continued to where an arm never was), 0.111 with 0.01, and 0.099 with 0.1. What
these quadratics leave is in the file as well.

Hands: wrist centers and orientations at both ends of reaches of 0.10 m or more, as a
mixture of normal distributions. Each is the mean and covariance of 20 reaches or more;
no recording is copied.

    python benchmarks/posture_habits_people.py \
        --out ikns/simulation/posture_habits.toml
"""

import argparse
from pathlib import Path

import numpy as np
from natural_posture_people import BESIDE, GATE, LICENSE, SOURCE
from null_space.people import Arm, ArmTrial, real_arms
from scipy.cluster.vq import kmeans2
from scipy.spatial.transform import Rotation

from ikns.simulation.posture_habits import habit_terms

Array = np.ndarray
#: Ridge of all arms together, and of each arm's departure from them.
RIDGE, DEPARTURE = 1e-3, 1e-2
#: Kinds of reaches, and the fewest that make one.
KINDS, FEWEST = 6, 20
MIRROR = np.diag([1.0, 1.0, -1.0])


def hand(arm: Arm, angles: Array) -> tuple[Array, Array, Array, Array]:
    """Shoulder and wrist, m, hand's rotation and long axis, as of a right arm."""
    shoulder = arm.skeleton.link_in_thorax(angles, f"{arm.side}_upper_arm")[0]
    wrist, rotation = arm.skeleton.link_in_thorax(angles, f"{arm.side}_hand")
    axis = arm.skeleton.link_in_thorax(angles, f"{arm.side}_knuckle")[0] - wrist
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    if arm.side == "left":
        shoulder, wrist, axis = shoulder @ MIRROR, wrist @ MIRROR, axis @ MIRROR
        rotation = MIRROR @ rotation @ MIRROR
    return shoulder, wrist, rotation, axis


def ends_of(trial: ArmTrial) -> list[list[int]]:
    """First and last frame of each reach in which the arm was seen."""
    seen = [a + np.flatnonzero(trial.known[a : b + 1]) for a, b in trial.reaches()]
    return [[int(rows[0]), int(rows[-1])] for rows in seen if rows.size >= 10]


def moving(arm: Arm) -> tuple[Array, Array]:
    """Terms (N, 28) and swivels (N,), rad, of moving frames."""
    rows = [trial.known & (trial.speed >= GATE) for trial in arm.trials]
    pairs = list(zip(arm.trials, rows, strict=True))
    angles = np.concatenate([trial.angles[row] for trial, row in pairs])
    _, wrist, _, axis = hand(arm, angles)
    return habit_terms(wrist, axis), np.concatenate([t.swivel[r] for t, r in pairs])


def fields(arms: list[Arm]) -> dict[str, object]:
    """Mean and covariance of the swivel's fields, and what they leave."""
    taught = [moving(arm) for arm in arms]
    A = np.array([phi.T @ phi / len(phi) for phi, _ in taught])
    b = np.array([phi.T @ s / len(phi) for phi, s in taught])
    free = np.diag([0.0] + [1.0] * 27)
    common = np.linalg.solve(A.mean(axis=0) + RIDGE * free, b.mean(axis=0))
    beyond = np.linalg.solve(A + DEPARTURE * free, (b - A @ common)[..., None])
    own = common + beyond[..., 0]
    left = [np.var(s - phi @ c) for (phi, s), c in zip(taught, own, strict=True)]
    return {
        "mean_rad": own.mean(axis=0),
        "covariance_rad2": np.cov(own.T),
        "residual_rad": round(float(np.sqrt(np.mean(left))), 6),
    }


def poses(arms: list[Arm]) -> dict[str, object]:
    """Mixture of the hand's poses at both ends of reaches.

    Wrist from the shoulder in arm lengths (upper arm and forearm), and the rotation
    vector from the mean orientation, at the start and at the end: 12 numbers a reach.
    """
    places, turns = [], []
    for arm in arms:
        lengths = arm.skeleton.segment_lengths
        reach = sum(lengths[f"{arm.side}_{s}"] for s in ("upper_arm", "forearm"))
        for trial in arm.trials:
            for ends in ends_of(trial):
                shoulder, wrist, rotation, _ = hand(arm, trial.angles[ends])
                places.append((wrist - shoulder) / reach)
                turns.append(rotation)
    n = len(places)
    turned = Rotation.from_matrix(np.reshape(turns, (-1, 3, 3)))
    middle = turned.mean()
    vectors = (middle.inv() * turned).as_rotvec().reshape(n, 2, 3)
    rows = np.concatenate([np.array(places), vectors], axis=2).reshape(n, 12)
    scaled = rows / rows.std(axis=0)
    for kinds in range(KINDS, 0, -1):
        _, kind = kmeans2(scaled, kinds, seed=0, minit="++", iter=50)
        counts = np.bincount(kind, minlength=kinds)
        if counts.min() >= FEWEST or kinds == 1:
            break
    return {
        "middle": middle.as_matrix(),
        "reaches": n,
        "share": counts / n,
        "pose_mean": np.array([rows[kind == k].mean(axis=0) for k in range(kinds)]),
        "pose_covariance": np.array([np.cov(rows[kind == k].T) for k in range(kinds)]),
    }


def written(name: str, value: object) -> str:
    """One line of TOML, or a few: arrays by rows, six digits."""
    if isinstance(value, np.ndarray):
        text = np.round(value, 6).tolist()
        inner = ",\n  ".join(str(row) for row in text)
        return f"{name} = [\n  {inner},\n]"
    return f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value!r}"


def main() -> None:
    """Write the file, or print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--out", type=Path, help="TOML file to write")
    parser.add_argument("--quick", action="store_true", help="two people, not written")
    options = parser.parse_args()
    arms = real_arms(options.data / "ue_adl", people=2 if options.quick else None)
    table: dict[str, object] = {
        "format": 1,
        "made_by": "benchmarks/posture_habits_people.py",
        "source": SOURCE.format(people=len({arm.person for arm in arms})),
        "license": LICENSE,
        "arms": len(arms),
        # From rest to rest at one place, an assumption: root mean square 1.9 deg.
        "rest_rad": round(float(np.radians(1.9)), 6),
    }
    table |= fields(arms) | poses(arms)
    text = "\n".join(written(name, value) for name, value in table.items()) + "\n"
    if options.out and not options.quick:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
