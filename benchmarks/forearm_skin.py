"""Does the tracked hand follow the hand? Seven people of UE_ADL, one table.

- Hand: angle between the tracked hand and a rigid fit of the hand's own four markers,
  both counted from the static trial; median and worst frame.
- Elbow flexion and wrist deviation against the authors' angles, |r| at the best onset
  of the elbow. Their wrist angles are those of the hand against the *skin* of the
  forearm, in the order flexion, twist, deviation (rebuilt from the clusters they agree
  within 0.5 deg); the twist, 20 to 70 deg of it, is left out. An anatomical deviation,
  after pronation, is another quantity. Both are shown: `skin` is theirs, taken from the
  tracked hand and the turned forearm cluster, `joint` is the model's joint.
"""

import argparse
import json
import platform
from pathlib import Path

import numpy as np
from real_people import BESIDE, best_shift
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.motion.motion import Motion
from ikns.numerics.rigid import rigid_transform
from ikns.recording.files import read
from ikns.recording.recording import Recording

#: Whose figures are told, whoever else is there.
PEOPLE = [f"ADL{number:03d}" for number in (1, 2, 3, 4, 5, 7, 8)]
#: Every so many frames.
STEP = 4


def link_in_world(skeleton: Skeleton, q: np.ndarray, link: str) -> np.ndarray:
    """Orientation of a link, (3, 3)."""
    thorax = Rotation.from_quat(q[3:7]).as_matrix()
    return thorax @ skeleton.link_in_thorax(q, link)[1]


def angle(rotation: np.ndarray) -> float:
    """Angle of a rotation, deg."""
    return float(np.degrees(Rotation.from_matrix(rotation).magnitude()))


def hand_off(
    skeleton: Skeleton, static: Recording, motion: Motion, seen: np.ndarray, side: str
) -> np.ndarray:
    """Angle between the tracked hand and its own cluster in every frame, deg."""
    worn = skeleton.marker_set
    calm = np.nanmean(worn.pick(static.labels, static.markers), axis=0)
    q = MarkerIK(skeleton).solve(calm).q
    letter = side[0].upper()
    own = [worn.labels.index(f"{letter}HAN{k}") for k in (1, 2, 3, 4)]
    before = link_in_world(skeleton, q, f"{side}_hand")
    off = []
    for posture, markers in zip(motion.q[::STEP], seen[::STEP], strict=True):
        if np.isfinite(markers[own]).all():
            cluster, _ = rigid_transform(calm[own], markers[own])
            tracked = link_in_world(skeleton, posture, f"{side}_hand") @ before.T
            off.append(angle(tracked @ cluster.T))
    return np.array(off)


def against_skin(
    skeleton: Skeleton, motion: Motion, seen: np.ndarray, side: str
) -> np.ndarray:
    """Deviation of the hand against the skin of the forearm, (T,) deg."""
    worn = skeleton.marker_set
    own = [m for m, label in enumerate(worn.labels) if label[1:4] == "LAR"]
    own = [m for m in own if worn.markers[m].link.startswith(side)]
    deviation = np.full(len(seen), np.nan)
    for i in range(0, len(seen), STEP):
        q, markers = motion.q[i], seen[i]
        if not np.isfinite(markers[own]).any():
            continue
        rigid = skeleton.markers_in_world(q)[own]
        turn, _ = rigid_transform(rigid, turned_markers(skeleton, q, markers)[own])
        skin = turn @ link_in_world(skeleton, q, f"{side}_forearm")
        hand = link_in_world(skeleton, q, f"{side}_hand")
        # X is the axis of flexion, Z of deviation, in links of the zero pose.
        turns = Rotation.from_matrix(skin.T @ hand).as_euler("XYZ", degrees=True)
        deviation[i] = turns[2]
    return deviation


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    """|r| over the frames that both have."""
    both = np.isfinite(a) & np.isfinite(b)
    return abs(float(np.corrcoef(a[both], b[both])[0, 1]))


def trial(
    skeleton: Skeleton, static: Recording, path: Path, side: str
) -> dict[str, object]:
    """Every figure of one trial."""
    recording = read(path)
    motion = MarkerIK(skeleton).track(recording)
    seen = skeleton.marker_set.pick(recording.labels, recording.markers)
    theirs = np.genfromtxt(
        path.with_name(f"{path.stem}angles.csv"),
        delimiter=",",
        names=True,
        deletechars="",
    )
    joints = np.degrees(motion.angles).T
    mine = dict(zip(skeleton.joint_names, joints, strict=True))
    r, onset = best_shift(
        mine[f"{side}_elbow_flexion"], theirs["elbow_flexion-extension"]
    )
    part = slice(onset, onset + len(theirs))
    deviation = theirs["wrist_radial-ulnar_deviation"]
    off = hand_off(skeleton, static, motion, seen, side)
    skin = against_skin(skeleton, motion, seen, side)
    joint = skeleton.joint_names.index(f"{side}_wrist_deviation")
    stops = np.degrees([skeleton.lower[joint], skeleton.upper[joint]])
    at = mine[f"{side}_wrist_deviation"]
    return {
        "trial": path.stem,
        "hand_median_deg": float(np.median(off)),
        "hand_worst_deg": float(off.max()),
        "elbow_r": r,
        "skin_r": correlation(skin[part], deviation),
        "joint_r": correlation(at[part], deviation),
        "deviation_sd_deg": float(np.nanstd(deviation)),
        "at_stop": float(np.mean((at < stops[0]) | (at > stops[1]))),
        "residual_mm": 1000 * float(np.nanmedian(motion.residual)),
        "worst_residual_mm": 1000 * float(np.nanmax(motion.residual)),
    }


def main() -> None:
    """Print the table by person, and what was to be reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="one person, two trials")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows = []
    for name in PEOPLE[:1] if options.quick else PEOPLE:
        folder = options.data / "ue_adl" / name
        static = read(folder / f"{name}_static.csv")
        # The shortest static trial lasts 0.2 s.
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.15
        )
        for task in "F" if options.quick else "FADC":
            for side in ("right", "left"):
                path = folder / f"{name}{task}{side[0].upper()}1.csv"
                rows.append({"person": name, **trial(skeleton, static, path, side)})
    if options.json:
        print(json.dumps(rows))
        return
    print(f"numpy {np.__version__}, Python {platform.python_version()}, real people\n")
    print("| person | hand median deg | worst trial | worst frame | elbow r, F A D |")
    print("|---|---|---|---|---|")
    for name in dict.fromkeys(str(row["person"]) for row in rows):
        own = [row for row in rows if row["person"] == name]
        elbow = min(r["elbow_r"] for r in own if str(r["trial"])[6] in "FAD")
        medians = [row["hand_median_deg"] for row in own]
        print(
            f"| {name} | {np.median(medians):.1f} | {max(medians):.1f} "
            f"| {max(r['hand_worst_deg'] for r in own):.1f} | {elbow:.4f} |"
        )
    print("\n| person | |r| skin | joint | at stop | residual mm | worst frame mm |")
    print("|---|---|---|---|---|---|")
    for name in dict.fromkeys(str(row["person"]) for row in rows):
        own = [row for row in rows if row["person"] == name]
        middle = {
            key: float(np.median([row[key] for row in own]))
            for key in ("skin_r", "joint_r", "at_stop", "residual_mm")
        }
        worst = max(row["worst_residual_mm"] for row in own)
        print(
            f"| {name} | {middle['skin_r']:.3f} | {middle['joint_r']:.3f} "
            f"| {middle['at_stop']:.0%} | {middle['residual_mm']:.1f} | {worst:.1f} |"
        )
    summary(rows)


def summary(rows: list[dict]) -> None:
    """Print what is reached of what was to be reached."""
    hand = [row["hand_median_deg"] for row in rows]
    elbow = [row["elbow_r"] for row in rows if row["trial"][6] in "FAD"]
    skin = [row["skin_r"] for row in rows]
    joint = [row["joint_r"] for row in rows]
    print(
        f"\nhand: {np.median(hand):.1f} deg (at most 15), worst trial {max(hand):.1f} "
        f"(at most 30)\nelbow r >= 0.995 in {sum(r >= 0.995 for r in elbow)} of "
        f"{len(elbow)} trials of F, A, D\nwrist deviation |r| >= 0.9 in "
        f"{sum(r >= 0.9 for r in skin)} of {len(skin)} trials against the skin (median "
        f"{np.median(skin):.3f}), in {sum(r >= 0.9 for r in joint)} as a joint (median "
        f"{np.median(joint):.3f})"
    )


if __name__ == "__main__":
    main()
