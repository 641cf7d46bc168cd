"""Scaling and marker inverse kinematics on real people, against others' results.

- UE_ADL (two persons, both arms, four tasks): segment lengths against tape measures,
  elbow flexion against the authors' angles, marker residual per segment.
- Stoop lifts (one person): marker residual against the authors' own.

Fitted lengths run from joint center to joint center. The database does not say from
where its tape ran; acromion to epicondyle, the usual way, is 4 to 5 cm more than the
upper arm's, and its two forearms of one person differ by 2 cm.
"""

import argparse
import csv
import json
import platform
import time
from pathlib import Path

import numpy as np
import pinocchio

from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.recording.files import read

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: Whose figures are told, whoever else is there: two people of UE_ADL, three lifts.
PEOPLE, LIFTS = ("ADL001", "ADL005"), (1, 2, 3)


def best_shift(mine: np.ndarray, theirs: np.ndarray) -> tuple[float, int]:
    """Highest correlation over all onsets, and the onset (frames)."""
    n = len(theirs)
    rows = []
    for k in range(len(mine) - n + 1):
        seen = np.isfinite(mine[k : k + n])
        both = mine[k : k + n][seen], theirs[seen]
        rows.append((float(np.corrcoef(*both)[0, 1]), k))
    return max(rows)


def by_segment(skeleton: Skeleton, motion, recording) -> dict[str, float]:
    """Median marker distance per link, mm."""
    seen = skeleton.marker_set.pick(recording.labels, recording.markers)
    model = np.stack(
        [turned_markers(skeleton, *row) for row in zip(motion.q, seen, strict=True)]
    )
    distance = 1000 * np.linalg.norm(model - seen, axis=2)
    links = np.array([marker.link for marker in skeleton.marker_set.markers])
    return {
        str(link): float(np.nanmedian(distance[:, links == link]))
        for link in dict.fromkeys(links)
    }


def ue_adl(folder: Path, *, quick: bool) -> list[dict]:
    """One row a trial, with the lengths of its person."""
    with (folder / "participants.csv").open() as file:
        people = {row["participant"]: row for row in csv.DictReader(file)}
    rows = []
    for name in PEOPLE:
        person = people[name]
        static = read(folder / name / f"{name}_static.csv")
        # One of the two static trials lasts 0.41 s.
        skeleton, report = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3
        )
        for task in "FADC":
            for side, letter in (("right", "R"), ("left", "L")):
                trial = folder / name / f"{name}{task}{letter}1.csv"
                if quick and (task, letter) not in (("F", "R"), ("C", "L")):
                    continue
                recording = read(trial)
                start = time.perf_counter()
                motion = MarkerIK(skeleton).track(recording)
                spent = time.perf_counter() - start
                theirs = np.genfromtxt(
                    trial.with_name(f"{trial.stem}angles.csv"),
                    delimiter=",",
                    names=True,
                    deletechars="",
                )["elbow_flexion-extension"]
                joint = skeleton.joint_names.index(f"{side}_elbow_flexion")
                mine = np.degrees(motion.angles[:, joint])
                r, onset = best_shift(mine, theirs)
                rows.append(
                    {
                        "trial": trial.stem,
                        "frames": len(motion.time),
                        "solved": int(np.isfinite(motion.residual).sum()),
                        "converged": float(motion.converged.mean()),
                        "elbow_r": r,
                        "residual_mm": 1000 * float(np.median(motion.residual)),
                        "us_per_frame": 1e6 * spent / len(motion.time),
                        "segments_mm": by_segment(skeleton, motion, recording),
                        "lengths_mm": {
                            part: [
                                1000 * report.lengths[f"{side}_{part}"],
                                1000 * report.length_sd[f"{side}_{part}"],
                                float(person[f"{side}_{part}_mm"]),
                            ]
                            for part in ("upper_arm", "forearm")
                        },
                    }
                )
    return rows


def stoop(folder: Path, *, quick: bool) -> list[dict]:
    """One row a lift: mean distance of the upper-body markers, ours and theirs, mm."""
    static = read(folder / "neu_t169_f250f350.c3d")
    skeleton, _ = scale(Skeleton.load(), static, marker_set="plug_in_gait")
    labels = skeleton.marker_set.labels
    rows = []
    for i in LIFTS[: 1 if quick else None]:
        (file,) = folder.glob(f"stoop{i}_*.c3d")
        recording = read(file)
        motion = MarkerIK(skeleton).track(recording)
        seen = skeleton.marker_set.pick(recording.labels, recording.markers)
        model = np.stack([skeleton.markers_in_world(q) for q in motion.q])
        mine = 1000 * np.linalg.norm(model - seen, axis=2)
        with (folder / f"markerError_stoop{i}.csv").open() as table:
            header = [cell.strip() for cell in table.readline().split(",")]
            errors = 1000 * np.loadtxt(table, delimiter=",")
        shared = [label for label in labels if label in header]
        theirs = errors[:, [header.index(label) for label in shared]]
        ours = mine[:, [labels.index(label) for label in shared]]
        rows.append(
            {
                "lift": file.stem,
                "markers": len(shared),
                "ours_mean_mm": float(np.nanmean(ours)),
                "theirs_mean_mm": float(theirs.mean()),
                "ours_max_mm": float(np.nanmax(ours)),
                "theirs_max_mm": float(theirs.max()),
                "converged": float(motion.converged.mean()),
            }
        )
    return rows


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="fewer trials")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    adl = ue_adl(options.data / "ue_adl", quick=options.quick)
    lifts = stoop(options.data / "stoop", quick=options.quick)
    if options.json:
        print(json.dumps({"ue_adl": adl, "stoop": lifts}))
        return
    print(
        f"numpy {np.__version__}, pinocchio {pinocchio.__version__}, "
        f"Python {platform.python_version()}, no random numbers\n"
    )
    print("| trial | frames | solved | converged | elbow r | residual mm | us/frame |")
    print("|---|---|---|---|---|---|---|")
    for row in adl:
        print(
            f"| {row['trial']} | {row['frames']} | {row['solved']} "
            f"| {row['converged']:.1%} | {row['elbow_r']:.4f} "
            f"| {row['residual_mm']:.1f} | {row['us_per_frame']:.0f} |"
        )
    reached = sum(row["elbow_r"] >= 0.99 for row in adl)
    print(f"\nelbow r >= 0.99 in {reached} of {len(adl)} trials\n")
    print("| segment | median residual mm |")
    print("|---|---|")
    for link in adl[0]["segments_mm"]:
        value = np.median([row["segments_mm"][link] for row in adl])
        print(f"| {link} | {value:.1f} |")
    print("\n| person, side | segment | fitted mm | sd | tape mm | difference |")
    print("|---|---|---|---|---|---|")
    shown = set()
    for row in adl:
        who = row["trial"][:6] + " " + {"R": "right", "L": "left"}[row["trial"][7]]
        if who in shown:
            continue
        shown.add(who)
        for part, (fitted, sd, tape) in row["lengths_mm"].items():
            print(
                f"| {who} | {part} | {fitted:.0f} | {sd:.0f} | {tape:.0f} "
                f"| {fitted - tape:+.0f} |"
            )
    print("\n| lift | markers | ours mm | theirs mm | ours max | theirs max |")
    print("|---|---|---|---|---|---|")
    for row in lifts:
        print(
            f"| {row['lift']} | {row['markers']} | {row['ours_mean_mm']:.1f} "
            f"| {row['theirs_mean_mm']:.1f} | {row['ours_max_mm']:.1f} "
            f"| {row['theirs_max_mm']:.1f} |"
        )


if __name__ == "__main__":
    main()
