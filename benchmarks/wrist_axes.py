"""What limits the agreement of wrist deviation with the authors' angles? Real people.

In `forearm_skin.py` the deviation of the tracked hand against the skin follows the
authors' with |r| >= 0.9 in a bit over half of the trials of UE_ADL. Their axes are
built on landmarks of each person; ours are the model's. Two frames of one segment
differ by a constant rotation, so the hand's orientation against the skin is taken as

    inv(A) R(t) B,  then turned X Y Z about axes of flexion, twist, deviation

with constant rotations A and B fitted to the authors' flexion and deviation of *other*
trials, and |r| is counted in trials that the fit never saw:

- model axes: A = B = 1;
- one A and B for everybody: fitted to the other six people (left arms mirrored);
- A and B of this arm: fitted to its other three trials.

What the last one gains over the first is due to axes, not to tracking; what the second
gains could be mended in the body. The rest is shown by how much the wrist deviates.
"""

import argparse
import json
import platform
from pathlib import Path
from typing import NamedTuple

import numpy as np
from forearm_skin import BESIDE, PEOPLE, STEP, link_in_world
from real_people import best_shift
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.numerics.rigid import rigid_transform
from ikns.recording.files import read

MIRROR = np.diag([1.0, 1.0, -1.0])
#: Frames of each trial that a fit sees; residuals beyond this are wrong turns, deg.
FRAMES, CAP = 40, 60.0
#: Standard deviation of A and B, rad: axes of landmarks differ by tens of degrees.
PRIOR_DEG = 20.0
#: Standard deviations of the authors' deviation by which trials are sorted, deg.
RANGES = (0.0, 2.5, 6.0, np.inf)


class Trial(NamedTuple):
    """A hand against the skin of its forearm, and the authors' angles."""

    person: str
    side: str
    turns: np.ndarray  # (N, 3, 3), of a right arm
    flexion: np.ndarray  # (N,) deg
    deviation: np.ndarray  # (N,) deg


def trial(skeleton: Skeleton, path: Path, side: str) -> Trial:
    """Track a trial; frames that the authors have as well."""
    recording = read(path)
    motion = MarkerIK(skeleton).track(recording)
    worn = skeleton.marker_set
    seen = worn.pick(recording.labels, recording.markers)
    theirs = np.genfromtxt(
        path.with_name(f"{path.stem}angles.csv"),
        delimiter=",",
        names=True,
        deletechars="",
    )
    elbow = skeleton.joint_names.index(f"{side}_elbow_flexion")
    bent = np.degrees(motion.angles[:, elbow])
    _, onset = best_shift(bent, theirs["elbow_flexion-extension"])
    own = [
        m
        for m, marker in enumerate(worn.markers)
        if marker.link == f"{side}_forearm" and marker.free_turn
    ]
    rows, turns = [], []
    for k in range(0, min(len(theirs), len(seen) - onset), STEP):
        q, markers = motion.q[onset + k], seen[onset + k]
        if np.isfinite(markers[own]).all() and np.isfinite(q).all():
            rigid = skeleton.markers_in_world(q)[own]
            turn, _ = rigid_transform(rigid, turned_markers(skeleton, q, markers)[own])
            skin = turn @ link_in_world(skeleton, q, f"{side}_forearm")
            turns.append(skin.T @ link_in_world(skeleton, q, f"{side}_hand"))
            rows.append(k)
    against = np.array(turns)
    if side == "left":
        against = MIRROR @ against @ MIRROR
    return Trial(
        path.stem[:6],
        side,
        against,
        theirs["wrist_flexion-extension"][rows],
        theirs["wrist_radial-ulnar_deviation"][rows],
    )


def angles(turns: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Flexion, twist and deviation with constant rotations A and B, (N, 3) deg."""
    before, after = Rotation.from_rotvec(axes[:3]), Rotation.from_rotvec(axes[3:])
    found = before.inv() * Rotation.from_matrix(turns) * after
    return np.unwrap(found.as_euler("XYZ", degrees=True), axis=0, period=360.0)


def fitted(trials: list[Trial]) -> np.ndarray:
    """Fit A and B, rotation vectors (6,), to flexion and deviation of some trials."""

    def residuals(axes: np.ndarray) -> np.ndarray:
        parts = [np.degrees(axes) / PRIOR_DEG]
        for each in trials:
            step = max(1, len(each.turns) // FRAMES)
            found = angles(each.turns[::step], axes)
            for mine, theirs in (
                (found[:, 0], each.flexion[::step]),
                (found[:, 2], each.deviation[::step]),
            ):
                # Each trial's zero is left open: only the shape is compared.
                off = mine - theirs - np.median(mine - theirs)
                parts.append(np.clip(off, -CAP, CAP) / np.sqrt(len(off)))
        return np.concatenate(parts)

    # The second start leaves the model's zero, near which angles may be singular.
    starts = (np.zeros(6), np.array([0.0, -0.6, 0.0, 0.0, 0.0, 0.0]))
    fits = [least_squares(residuals, start, max_nfev=15) for start in starts]
    return np.asarray(min(fits, key=lambda fit: fit.cost).x)


def agreement(each: Trial, axes: np.ndarray) -> float:
    """|r| of the deviation with the authors'."""
    mine = angles(each.turns, axes)[:, 2]
    return abs(float(np.corrcoef(mine, each.deviation)[0, 1]))


def main() -> None:
    """Print how many trials agree, by axes and by range of motion."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="two people, two trials")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    trials: list[Trial] = []
    for name in PEOPLE[:2] if options.quick else PEOPLE:
        folder = options.data / "ue_adl" / name
        static = read(folder / f"{name}_static.csv")
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.15
        )
        for task in "DC" if options.quick else "FADC":
            for side in ("right",) if options.quick else ("right", "left"):
                path = folder / f"{name}{task}{side[0].upper()}1.csv"
                trials.append(trial(skeleton, path, side))
    rows: dict[str, list[float]] = {"model": [], "everybody": [], "this arm": []}
    common = {
        name: fitted([each for each in trials if each.person != name])
        for name in dict.fromkeys(each.person for each in trials)
    }
    for each in trials:
        arm = each.person, each.side
        others = [e for e in trials if (e.person, e.side) == arm and e is not each]
        rows["model"].append(agreement(each, np.zeros(6)))
        rows["everybody"].append(agreement(each, common[each.person]))
        rows["this arm"].append(agreement(each, fitted(others)))
    spread = np.array([np.std(each.deviation) for each in trials])
    if options.json:
        print(json.dumps(rows | {"deviation_sd_deg": spread.tolist()}))
        return
    print(f"numpy {np.__version__}, Python {platform.python_version()}, real people\n")
    print("| axes | |r| >= 0.9 | median | by sd of the deviation, deg |")
    print("|---|---|---|---|")
    for axes, values in rows.items():
        r, parts = np.array(values), []
        for low, high in zip(RANGES[:-1], RANGES[1:], strict=True):
            within = (spread >= low) & (spread < high)
            end = f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}"
            parts.append(f"{(r[within] >= 0.9).sum()} of {within.sum()} ({end})")
        print(
            f"| {axes} | {(r >= 0.9).sum()} of {len(r)} | {np.median(r):.3f} "
            f"| {', '.join(parts)} |"
        )


if __name__ == "__main__":
    main()
