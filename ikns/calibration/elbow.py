"""The sign of c: it increases with the height of the elbow."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import chain_joints, chain_sides
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


def two_arms_fault(chain: str, n_dof: int, n_components: ArrayLike) -> str:
    """Say that one degree of freedom is too few for two elbows; empty where it is not.

    >>> two_arms_fault("both_arms", 1, [1, 1]), two_arms_fault("right_arm", 1, [2])
    ('', '')
    """
    too_few = n_dof == 1 and len(chain_sides(chain)) > 1
    return _TWO_ARMS if too_few and np.any(np.asarray(n_components) > 1) else ""


def elbow_reference(
    skeleton: Skeleton, q: Array, chain: str, *, n_dof: int = 1
) -> Array | None:
    """Gradient of the height of the elbow in the thorax frame, which c increases with.

    At a posture `q` (25,) or (18,), rad. For two arms the heights of both elbows are
    summed; with several degrees of freedom each elbow has its own row, followed by
    forearm pronation, wrist flexion and wrist deviation of each side.

    Returns
    -------
    (n_dof, n) array or None
        Height gradients along the chain's joints, m/rad; rows of single joints are 1.
        None when there are fewer rows than degrees of freedom.
    """
    joints, sides = chain_joints(chain), chain_sides(chain)
    first = len(q) - len(skeleton.joint_names)
    height = np.zeros((len(sides), len(joints)))
    for j, joint in enumerate(joints):
        for step in (_STEP, -_STEP):
            moved = np.array(q, dtype=np.float64)
            moved[first + skeleton.joint_names.index(joint)] += step
            elbows = [skeleton.link_in_thorax(moved, f"{s}_forearm")[0] for s in sides]
            height[:, j] += np.array(elbows)[:, 1] / (2 * step)
    if n_dof == 1:
        return height.sum(axis=0, keepdims=True)
    single = [
        np.eye(len(joints))[joints.index(f"{side}_{joint}")]
        for joint in ("forearm_pronation", "wrist_flexion", "wrist_deviation")
        for side in sides
    ]
    rows = np.vstack([height, *single])
    return rows[:n_dof] if len(rows) >= n_dof else None
