"""Which shoulder sequence bends the arm's self-motion least? One table.

For each of the twelve rotation sequences (thorax axes: X forward, Y up, Z right) the
right arm holds its hand pose at points of a calibration workspace while the elbow
swivels. Two things are measured on the same postures:

- conditioning: the ratio of the largest to the smallest singular value of the map from
  the three angles' rates to the angular velocity (1 is best, infinite at gimbal lock);
- hand leak: how far the hand moves when the joint vector follows the first principal
  component of the self-motion to the ends of its range (0 if self-motion is straight).

The arm is written out here with `scipy.spatial.transform.Rotation`, independently of
the URDF that was built from the result.
"""

import argparse
import itertools
import platform

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

UPPER_ARM, FOREARM, HAND = 0.278, 0.267, 0.082  # de Leva 1996, mean of men and women
SHOULDER = np.array([-0.018, -0.007, 0.171])  # glenohumeral center from the notch
SEQUENCES = [
    "".join(s)
    for s in itertools.product("XYZ", repeat=3)
    if s[0] != s[1] and s[1] != s[2]
]
SWIVEL = np.radians(np.linspace(-35.0, 35.0, 29))


def workspace(rng: np.random.Generator, n: int) -> np.ndarray:
    """Wrist positions in the thorax frame, a box in front of the chest, (n, 3) m."""
    corners = np.array(list(itertools.product([0.18, 0.40], [-0.35, 0.0], [0.0, 0.32])))
    inside = rng.uniform(corners.min(axis=0), corners.max(axis=0), (n, 3))
    reach = np.linalg.norm(np.vstack([corners, inside]) - SHOULDER, axis=1)
    return np.vstack([corners, inside])[reach < 0.95 * (UPPER_ARM + FOREARM)]


def self_motion(
    wrist: np.ndarray, center: float
) -> tuple[Rotation, np.ndarray, Rotation]:
    """Shoulder rotations, elbow angle and hand-in-forearm over a swivel sweep."""
    to_wrist = wrist - SHOULDER
    distance = np.linalg.norm(to_wrist)
    axis = to_wrist / distance
    cosine = (distance**2 + UPPER_ARM**2 - FOREARM**2) / (2 * distance * UPPER_ARM)
    down = -np.eye(3)[1] - axis * -axis[1]
    down /= np.linalg.norm(down)
    # Zero swivel: elbow below the line to the wrist; positive lifts the right elbow.
    swivel = Rotation.from_rotvec((SWIVEL + center)[:, None] * axis)
    elbow = SHOULDER + UPPER_ARM * (
        cosine * axis + np.sqrt(1 - cosine**2) * swivel.apply(down)
    )
    up = (SHOULDER - elbow) / UPPER_ARM
    forearm = (wrist - elbow) / FOREARM
    right = np.cross(forearm, up)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    shoulder = Rotation.from_matrix(np.stack([np.cross(up, right), up, right], axis=2))
    flexion = np.arccos(np.clip(np.sum(-up * forearm, axis=1), -1, 1))
    elbow_frame = shoulder * Rotation.from_euler("Z", flexion[:, None])
    middle = len(SWIVEL) // 2
    hand = elbow_frame[middle]  # neutral wrist in the middle of the sweep
    return shoulder, flexion, elbow_frame.inv() * hand


def forward(q: np.ndarray, sequence: str) -> tuple[np.ndarray, Rotation]:
    """Knuckle position and hand orientation for joint vectors (N, 7)."""
    shoulder = Rotation.from_euler(sequence, q[:, :3])
    forearm = shoulder * Rotation.from_euler("Z", q[:, 3:4])
    hand = forearm * Rotation.from_euler("YXZ", q[:, 4:])
    position = (
        SHOULDER
        + shoulder.apply([0, -UPPER_ARM, 0])
        + forearm.apply([0, -FOREARM, 0])
        + hand.apply([0, -HAND, 0])
    )
    return position, hand


def conditioning(angles: np.ndarray, sequence: str) -> np.ndarray:
    """Condition number of the angle-rate map, (N,)."""
    axes = np.eye(3)[["XYZ".index(s) for s in sequence]]
    first = Rotation.from_rotvec(angles[:, :1] * axes[0])
    second = first * Rotation.from_rotvec(angles[:, 1:2] * axes[1])
    matrix = np.stack(
        [
            np.broadcast_to(axes[0], (len(angles), 3)),
            first.apply(axes[1]),
            second.apply(axes[2]),
        ],
        axis=2,
    )
    return np.linalg.cond(matrix)


def measure(sequence: str, wrists: np.ndarray, center: float) -> np.ndarray:
    """Condition numbers (worst per point) and hand leak in mm, (points, 2)."""
    rows = []
    for wrist in wrists:
        shoulder, flexion, hand = self_motion(wrist, center)
        angles = np.unwrap(shoulder.as_euler(sequence), axis=0)
        wrist_angles = np.unwrap(hand.as_euler("YXZ"), axis=0)
        q = np.column_stack([angles, flexion, wrist_angles])
        mean = q.mean(axis=0)
        direction = np.linalg.svd(q - mean, full_matrices=False)[2][0]
        along = (q - mean) @ direction
        ends = mean + np.outer([along.min(), 0.0, along.max()], direction)
        position, _ = forward(ends, sequence)
        leak = np.linalg.norm(position - position[1], axis=1).max()
        rows.append([conditioning(angles, sequence).max(), 1000 * leak])
    return np.array(rows)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="fewer points")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    wrists = workspace(rng, 30 if options.quick else 300)
    print(
        f"{len(wrists)} points, swivel +-35 deg about 20 deg, seed {options.seed}, "
        f"numpy {np.__version__}, scipy {scipy.__version__}, "
        f"Python {platform.python_version()}"
    )
    print("| sequence | condition p50 | p95 | worst | leak p50 mm | p95 | worst |")
    print("|---|---|---|---|---|---|---|")
    table = {s: measure(s, wrists, np.radians(20.0)) for s in SEQUENCES}
    for s in sorted(SEQUENCES, key=lambda s: np.median(table[s][:, 1])):
        cells = [
            f"{np.percentile(column, p):.1f}"
            for column in table[s].T
            for p in (50, 95, 100)
        ]
        print(f"| {s[0]}-{s[1]}-{s[2]} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
