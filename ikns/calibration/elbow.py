"""The sign of c: it increases with the height of the elbow."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_joints, joint_sides
from ikns.body.skeleton import Skeleton

#: Angle step of the central difference, rad: its error is of the order of the step
#: squared (1e-10 m/rad), that of rounding 1e-16 m over the step (1e-11 m/rad).
_STEP = 1e-5

#: Two elbows that move by themselves, read by one direction.
_TWO_ARMS = (
    "two arms have two degrees of freedom, one for each elbow, "
    "and a single one mixes them differently at every place; use two degrees of "
    "freedom (--n-dof 2), or move both elbows together"
)


def two_arms_fault(chain: ChainLike, n_dof: int, n_components: ArrayLike) -> str:
    """Say that one degree of freedom is too few for two elbows; empty where it is not.

    >>> two_arms_fault("both_arms", 1, [1, 1]), two_arms_fault("right_arm", 1, [2])
    ('', '')
    """
    too_few = n_dof == 1 and len(joint_sides(chain)) > 1
    return _TWO_ARMS if too_few and np.any(np.asarray(n_components) > 1) else ""


def elbow_reference(
    skeleton: Skeleton, q: Array, chain: ChainLike, *, n_dof: int = 1
) -> Array | None:
    """Gradient of the height of the elbow in the thorax frame, which c increases with.

    At a posture `q` (25,) or (18,), rad. For two arms the heights of both elbows are
    summed; with several degrees of freedom each elbow has its own row, followed by
    forearm pronation, wrist flexion and wrist deviation of each side.

    Returns
    -------
    (n_dof, n) array or None
        Height gradients along the chain's joints, m/rad; rows of single joints are 1.
        None when there are fewer rows than degrees of freedom. Elbows that the chain
        does not raise have no row.
    """
    rows, elbows = motion_rows(skeleton, q, chain)
    if n_dof == 1 and elbows:
        return rows[:elbows].sum(axis=0, keepdims=True)
    return rows[:n_dof] if len(rows) >= n_dof else None


def motion_rows(skeleton: Skeleton, q: Array, chain: ChainLike) -> tuple[Array, int]:
    """Return the rows of :func:`elbow_reference`, and how many are elbows'."""
    joints, sides = chain_joints(chain), joint_sides(chain)
    first = len(q) - len(skeleton.joint_names)
    height = np.zeros((len(sides), len(joints)))
    for j, joint in enumerate(joints):
        for step in (_STEP, -_STEP):
            moved = np.array(q, dtype=np.float64)
            moved[first + skeleton.joint_names.index(joint)] += step
            elbows = [skeleton.link_in_thorax(moved, f"{s}_forearm")[0] for s in sides]
            height[:, j] += np.array(elbows)[:, 1] / (2 * step)
    height = height[height.any(axis=1)]
    single = [
        np.eye(len(joints))[joints.index(f"{side}_{joint}")]
        for joint in ("forearm_pronation", "wrist_flexion", "wrist_deviation")
        for side in sides
        if f"{side}_{joint}" in joints
    ]
    return np.vstack([height, *single]), len(height)
