"""Where are elbow and wrist, seen from the skin markers over them? Seven people.

The markers on the epicondyles and the styloids of UE_ADL sit on skin toward the back of
the arm. Where the joints are is told by motion alone: the point that keeps its place in
the clusters of both neighboring segments (symmetrical center of rotation estimation,
Ehrig et al. 2006, J Biomech 39:2798), without any skeleton or inverse kinematics.

- center: its place in the static trial, seen from the middle of the two landmarks, mm:
  along the proximal segment; toward the lateral or radial landmark; to the front of the
  elbow or the palm. Mean of the two segments' estimates;
- gap: root mean square distance between the places to which the two clusters carry the
  midpoint, and the center, mm.
"""

import argparse
import json
import platform
from pathlib import Path

import numpy as np
from forearm_skin import BESIDE, PEOPLE

from ikns.errors import IknsError
from ikns.recording.files import read
from ikns.recording.recording import Recording

Array = np.ndarray
#: Clusters of the two segments, landmarks (the lateral or radial one first), and what
#: gives the proximal segment its direction: landmarks or a cluster.
JOINTS = {
    "elbow": (("UAR", "LAR"), ("LEP", "MEP"), ("SHO1", "SHO2", "SHO3", "SHO4")),
    "wrist": (("LAR", "HAN"), ("SPR", "SPU"), ("LEP", "MEP")),
}
#: Every so many frames of 100 Hz.
STEP = 5


def places(recording: Recording, labels: list[str]) -> Array:
    """Markers by the ends of their labels, (T, n, 3) m."""
    own = [label.split(":")[-1] for label in recording.labels]
    return recording.markers[:, [own.index(label) for label in labels]]


def carried(static: Array, moving: Array) -> tuple[Array, Array]:
    """Rotations (T, 3, 3) and translations (T, 3) of a cluster since the static trial.

    Least squares by singular values (Kabsch 1976), all frames at once; NaN where a
    marker is missing.
    """
    rotation = np.full((len(moving), 3, 3), np.nan)
    translation = np.full((len(moving), 3), np.nan)
    seen = np.isfinite(moving).all(axis=(1, 2))
    middle = moving[seen].mean(axis=1)
    spread = np.einsum(
        "ni,tnj->tij", static - static.mean(axis=0), moving[seen] - middle[:, None]
    )
    left, _, right = np.linalg.svd(spread)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    rotation[seen] = np.swapaxes(left @ right, 1, 2)
    translation[seen] = middle - rotation[seen] @ static.mean(axis=0)
    return rotation, translation


def joint(static: Recording, trials: list[Recording], name: str, letter: str) -> dict:
    """Center of one joint of one arm, and what it mends."""
    clusters, landmarks, above = JOINTS[name]
    calm = [
        np.nanmean(places(static, [f"{letter}{part}{k}" for k in range(1, 5)]), axis=0)
        for part in clusters
    ]
    pair = np.nanmean(places(static, [letter + mark for mark in landmarks]), axis=0)
    middle = pair.mean(axis=0)
    start = np.nanmean(places(static, [letter + mark for mark in above]), axis=(0, 1))
    along = (middle - start) / np.linalg.norm(middle - start)
    across = pair[0] - pair[1]
    across -= (across @ along) * along
    across /= np.linalg.norm(across)
    # To the back of a right elbow the other way round than to the back of a hand.
    front = np.cross(across, along) * (1.0 if letter == "R" else -1.0)
    rows, gaps = [], []
    for trial in trials:
        (turn_a, move_a), (turn_b, move_b) = (
            carried(
                rest,
                places(trial, [f"{letter}{part}{k}" for k in range(1, 5)])[::STEP],
            )
            for part, rest in zip(clusters, calm, strict=True)
        )
        seen = np.isfinite(move_a).all(axis=1) & np.isfinite(move_b).all(axis=1)
        rows.append(np.concatenate([turn_a, -turn_b], axis=2)[seen].reshape(-1, 6))
        gaps.append(((turn_b - turn_a) @ middle + move_b - move_a)[seen].reshape(-1))
    system, gap = np.concatenate(rows), np.concatenate(gaps)
    # Along a hinge's own axis no motion tells the center: the smallest norm is taken.
    both = np.linalg.lstsq(system, gap, rcond=1e-3)[0]
    center = np.stack([along, across, front]) @ (both[:3] + both[3:]) / 2
    left = gap - system @ both
    return {
        "center_mm": (1000 * center).tolist(),
        "gap_mm": [1000 * float(np.sqrt(3 * np.mean(x**2))) for x in (gap, left)],
    }


def recorded(folder: Path, letter: str) -> list[Recording]:
    """All trials of an arm that can be read."""
    found = []
    for path in sorted(folder.glob(f"{folder.name}?{letter}?.csv")):
        try:
            found.append(read(path))
        except IknsError:
            continue
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="one person")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows = []
    for person in PEOPLE[:1] if options.quick else PEOPLE:
        folder = options.data / "ue_adl" / person
        static = read(folder / f"{person}_static.csv")
        for letter in "RL":
            trials = recorded(folder, letter)
            rows += [
                {
                    "arm": f"{person} {letter}",
                    "joint": name,
                    **joint(static, trials, name, letter),
                }
                for name in JOINTS
            ]
    if options.json:
        print(json.dumps(rows))
        return
    print(f"numpy {np.__version__}, Python {platform.python_version()}, real people\n")
    print("| arm | joint | along mm | lateral mm | front mm | gap mm | at center mm |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        shown = " | ".join(f"{x:.0f}" for x in row["center_mm"])
        before, after = row["gap_mm"]
        print(
            f"| {row['arm']} | {row['joint']} | {shown} | {before:.1f} | {after:.1f} |"
        )
    print()
    for name in JOINTS:
        own = np.array([row["center_mm"] for row in rows if row["joint"] == name])
        gaps = np.array([row["gap_mm"] for row in rows if row["joint"] == name])
        print(
            f"{name}: center along, lateral, front {np.round(own.mean(axis=0), 1)} mm, "
            f"sd {np.round(own.std(axis=0, ddof=1), 1)}; gap "
            f"{np.median(gaps[:, 0]):.1f} mm, at the center {np.median(gaps[:, 1]):.1f}"
            if len(own) > 2
            else f"{name}: one person"
        )


if __name__ == "__main__":
    main()
