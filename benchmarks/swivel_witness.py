"""How much of a swivel does a tracked arm show? Joint centers without a model tell.

Elbow and wrist are carried along by the rigid fit of the clusters of upper arm and
forearm, from their centers in the static trial (`joint_centers`); only the shoulder is
the model's. Their plane tells the swivel without inverse kinematics. A natural posture
(a quadratic in the wrist's place) is taken off each, and what is left is compared, in
frames whose elbow is bent by 25 deg or more:

- gain: slope of the tracked swivel over the witness's, and their correlation, median
  over arms. `hinge` is what intent reads, `plane` is that of the model's own joint
  centers, `skin` the line through the epicondyles, carried by the upper arm's cluster;
- change: what a reach leaves of each after the natural posture (fitted to all frames
  of an arm), mean, in units of 70 deg.

Skin over the upper arm follows its turns in part. What follows it shows less of what
people do, and of what they wish: a smaller change is not a better one.
"""

import argparse
import json
import platform
from pathlib import Path

import numpy as np
from joint_centers import carried, places
from natural_posture_people import GATE
from null_space.methods import RANGE
from null_space.people import Arm, real_arms
from scipy.spatial.transform import Rotation

from ikns.errors import IknsError
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.hinge_swivel import hinge_swivel, mirrored
from ikns.nullspace.posture_terms import quadratic_terms
from ikns.recording.files import read
from ikns.recording.recording import Recording

Array = np.ndarray
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: Straighter elbows have no plane.
BENT = np.radians(25.0)
READ = ("hinge", "plane", "skin")


def landmark(static: Recording, label: str) -> Array:
    """Place of a marker in the static trial, (3,) m."""
    return np.nanmean(places(static, [label])[:, 0], axis=0)


def followed(static: Recording, trial: Recording, cluster: str) -> tuple[Array, Array]:
    """Rotations and translations of a cluster since the static trial."""
    names = [f"{cluster}{k}" for k in range(1, 5)]
    return carried(np.nanmean(places(static, names), axis=0), places(trial, names))


def swivels(arm: Arm, folder: Path, static: Recording, name: str) -> dict[str, Array]:
    """Wrists (T, 3) and swivels (T,) of a trial, by who tells them; NaN if unknown."""
    letter = arm.side[0].upper()
    recording = read(folder / f"{folder.name}{name[0]}{letter}{name[1]}.csv")
    motion = MarkerIK(arm.skeleton).track(recording, chain=arm.chain)
    seen = motion.in_sight(arm.chain) & np.isfinite(motion.q).all(axis=1)
    angles = np.where(seen[:, None], motion.angles, np.nan)
    shoulder, upper = arm.skeleton.link_in_thorax(angles, f"{arm.side}_upper_arm")
    elbow = arm.skeleton.link_in_thorax(angles, f"{arm.side}_forearm")[0]
    wrist = arm.skeleton.link_in_thorax(angles, f"{arm.side}_hand")[0]
    hinge = upper[..., :, 2]

    thorax = np.full((len(seen), 3, 3), np.nan)
    thorax[seen] = Rotation.from_quat(motion.q[seen, 3:7]).as_matrix()

    def in_thorax(vectors: Array) -> Array:
        return np.einsum("tji,tj->ti", thorax, vectors)

    def joint(cluster: str, pair: tuple[str, str]) -> Array:
        middle = sum(landmark(static, letter + label) for label in pair) / 2
        turn, move = followed(static, recording, letter + cluster)
        return in_thorax(turn @ middle + move - motion.q[:, :3])

    def plane(elbows: Array, wrists: Array) -> Array:
        normal = np.cross(elbows - shoulder, wrists - elbows)
        normal *= np.sign((normal * hinge).sum(axis=1, keepdims=True))
        return hinge_swivel(shoulder, wrists, normal, side=arm.side)

    elbows, wrists = joint("UAR", ("LEP", "MEP")), joint("LAR", ("SPR", "SPU"))
    line = landmark(static, f"{letter}LEP") - landmark(static, f"{letter}MEP")
    line = line if arm.side == "right" else -line
    skin = in_thorax(followed(static, recording, f"{letter}UAR")[0] @ line)
    flexion = angles[:, arm.skeleton.joint_names.index(f"{arm.side}_elbow_flexion")]
    return {
        "wrist": mirrored(wrist, arm.side),
        "witness_wrist": mirrored(wrists, arm.side),
        "witness": plane(elbows, wrists),
        "hinge": hinge_swivel(shoulder, wrist, hinge, side=arm.side),
        "plane": plane(elbow, wrist),
        "skin": hinge_swivel(shoulder, wrists, skin, side=arm.side),
        "bent": flexion >= BENT,
        "speed": motion.hand_speed(arm.chain),
    }


def left_after(wrist: Array, swivel: Array, taught: Array) -> Array:
    """Swivels less the natural posture of the taught frames, rad."""
    terms = quadratic_terms(wrist)
    fit = np.linalg.lstsq(terms[taught], swivel[taught], rcond=None)[0]
    return swivel - terms @ fit


def of_arm(arm: Arm, folder: Path, static: Recording) -> dict[str, list[float]]:
    """Gain, correlation and change of one arm, by what is read."""
    trials = [
        swivels(arm, folder, static, f"{one.task}{one.repeat}") for one in arm.trials
    ]
    every = {key: np.concatenate([one[key] for one in trials]) for key in trials[0]}
    known = np.isfinite(np.column_stack([every[k] for k in ("witness", *READ)]))
    taught = known.all(axis=1) & every["bent"] & (every["speed"] >= GATE)
    starts = np.cumsum([0] + [len(one["speed"]) for one in trials])
    ends = []
    for one, start in zip(arm.trials, starts, strict=False):
        for a, b in one.reaches():
            rows = start + a + np.flatnonzero(known[start + a : start + b + 1].all(1))
            if rows.size >= 10:
                ends.append((rows[0], rows[-1]))
    first, last = np.array(ends, dtype=int).reshape(-1, 2).T
    rest = {
        key: left_after(
            np.nan_to_num(
                every["wrist" if key in ("hinge", "plane") else "witness_wrist"]
            ),
            every[key],
            taught,
        )
        for key in ("witness", *READ)
    }
    said = {}
    for key in ("witness", *READ):
        mine, other = rest[key][taught], rest["witness"][taught]
        change = np.abs(rest[key][last] - rest[key][first]) / RANGE
        said[key] = [
            float(mine @ other / (other @ other)),
            float(np.corrcoef(mine, other)[0, 1]),
            float(change.mean()) if len(change) else np.nan,
        ]
    return said


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="one person")
    parser.add_argument("--marker-set", default="ue_adl", help="set, or TOML file")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    folder = options.data / "ue_adl"
    rows = {}
    for arm in real_arms(
        folder, people=1 if options.quick else None, marker_set=options.marker_set
    ):
        static = read(folder / arm.person / f"{arm.person}_static.csv")
        try:
            rows[f"{arm.person} {arm.side}"] = of_arm(arm, folder / arm.person, static)
        except IknsError as error:
            raise SystemExit(str(error)) from None
    if options.json:
        print(json.dumps(rows))
        return
    print(
        f"{len(rows)} real arms, marker set {options.marker_set}; numpy "
        f"{np.__version__}, Python {platform.python_version()}\n"
    )
    print("| read | gain | r | change |")
    print("|---|---|---|---|")
    for key in ("witness", *READ):
        own = np.array([row[key] for row in rows.values()])
        gain, r = np.median(own[:, :2], axis=0)
        print(f"| {key} | {gain:.3f} | {r:.3f} | {np.nanmean(own[:, 2]):.4f} |")


if __name__ == "__main__":
    main()
