"""A solved frame, the weights of the cost, and where to start."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton

#: Pull towards the pose before, m/rad and m/m: the ratio of marker noise (1 mm) to
#: what a joint typically turns within a frame (5 rad/s at 100 Hz is 0.05 rad). A joint
#: with markers 50 mm from its axis lags by (0.02 / 0.05)^2 = 16 % of a frame, one with
#: 200 mm by 1 %; what markers barely show no longer jitters.
PRIOR = 2e-2
#: The same from scratch, where the start is a guess: it only settles unseen joints.
PRIOR_FROM_SCRATCH = 5e-4
#: Stiffness of the joint limits, m/rad: 10 deg beyond a limit costs as much as 9 mm.
LIMIT = 0.05
#: A frame has converged when no joint moves more than this in a step, rad and m.
STEP_TOLERANCE = 1e-5
#: Steps after which a frame is given up; from scratch it takes about twenty.
MAX_ITERATIONS = 50
#: Root mean square residual above which a frame is also tried from scratch, m. Soft
#: tissue and modeling leave 10 to 20 mm (stoop lifts, see benchmarks/real_people.py).
LOST = 0.06
#: Arm poses to start from when nothing is known: hanging, forearm forward, reaching
#: forward, reaching sideways, hand at the mouth, hand overhead; rad.
_STARTS: tuple[dict[str, float], ...] = (
    {},
    {"elbow_flexion": 1.4},
    {"shoulder_flexion": 1.2, "elbow_flexion": 0.4},
    {"shoulder_abduction": 1.4, "elbow_flexion": 0.3},
    {"shoulder_flexion": 0.9, "shoulder_rotation": 0.5, "elbow_flexion": 2.2},
    {"shoulder_abduction": 2.2, "elbow_flexion": 0.8},
)


class Pose(NamedTuple):
    """One solved frame.

    Parameters
    ----------
    q : (nq,) array
        Configuration.
    residual : float
        Root mean square marker distance over the seen markers, m; NaN without any.
    iterations : int
        Steps tried.
    converged : bool
        Whether the last step met the tolerance.
    """

    q: Array
    residual: float
    iterations: int
    converged: bool


class SolvedFrames(NamedTuple):
    """Solved frames, (T, nq) and (T,) arrays; see :class:`Pose`.

    `fits` says of each arm, (T, 2), whether its markers and those of the thorax pass
    the gate; see :class:`ikns.motion.marker_ik.gate.GateLimits`.
    """

    q: Array
    residual: Array
    iterations: Indices
    converged: Mask
    fits: Mask

    @classmethod
    def of(cls, rows: Array) -> Self:
        """Take them from the kernel's rows, one a frame.

        See :func:`ikns._kernels.body.frame_sequence.solve_frames`.
        """
        nq = rows.shape[1] - 3 - len(SIDES)
        return cls(
            rows[:, :nq].copy(),
            rows[:, nq].copy(),
            rows[:, nq + 1].astype(np.int64),
            rows[:, nq + 2] > 0,
            rows[:, nq + 3 :] > 0,
        )


def starting_poses(skeleton: Skeleton) -> Array:
    """Return configurations to start from when nothing is known, (S, nq)."""
    poses = np.tile(skeleton.neutral(), (len(_STARTS), 1))
    for q, start in zip(poses, _STARTS, strict=True):
        for joint, angle in start.items():
            for side in SIDES:
                q[7 + skeleton.joint_names.index(f"{side}_{joint}")] = angle
    return poses
