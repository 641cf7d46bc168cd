"""A tree of joints as arrays, and where its joints are.

Every joint's frame is turned so that its axis is z. The pose of joint i in the world is
that of its parent, times its fixed placement there, times its own motion: a turn about
z (revolute), a shift along z (prismatic) or any pose (free flyer, seven numbers of q:
position and unit quaternion x, y, z, w).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled

__all__ = ["FREE_FLYER", "PRISMATIC", "REVOLUTE", "Tree", "joint_axes", "place_joints"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

REVOLUTE, PRISMATIC, FREE_FLYER = 0, 1, 2


class Tree(NamedTuple):
    """J joints with n degrees of freedom, parents before children.

    Parameters
    ----------
    kind : (J,) integer array
        REVOLUTE, PRISMATIC or FREE_FLYER.
    parent : (J,) integer array
        Joint that carries this one; -1 is the world.
    first_q, first_v : (J,) integer arrays
        Where the joint's numbers begin in q and in v.
    rotation : (J, 3, 3) array
    translation : (J, 3) array
        The joint's placement in its parent's frame, m.
    dof_parent : (n,) integer array
        The degree of freedom before this one on the way to the root, or -1.
    """

    kind: Indices
    parent: Indices
    first_q: Indices
    first_v: Indices
    rotation: Floats
    translation: Floats
    dof_parent: Indices


@compiled
def place_joints(tree: Tree, q: Floats, rotation: Floats, translation: Floats) -> None:
    """Write the joints' poses in the world, (J, 3, 3) and (J, 3) m."""
    for j in range(len(tree.kind)):
        parent = tree.parent[j]
        at = tree.first_q[j]
        R, p = rotation[j], translation[j]
        # The joint's placement in the world.
        if parent < 0:
            R[:] = tree.rotation[j]
            p[:] = tree.translation[j]
        else:
            up, own, shift = rotation[parent], tree.rotation[j], tree.translation[j]
            for a in range(3):
                for b in range(3):
                    R[a, b] = (
                        up[a, 0] * own[0, b]
                        + up[a, 1] * own[1, b]
                        + up[a, 2] * own[2, b]
                    )
                p[a] = (
                    translation[parent, a]
                    + up[a, 0] * shift[0]
                    + up[a, 1] * shift[1]
                    + up[a, 2] * shift[2]
                )
        # Its own motion.
        if tree.kind[j] == REVOLUTE:
            c, s = np.cos(q[at]), np.sin(q[at])
            for a in range(3):
                x, y = R[a, 0], R[a, 1]
                R[a, 0] = c * x + s * y
                R[a, 1] = c * y - s * x
        elif tree.kind[j] == PRISMATIC:
            for a in range(3):
                p[a] += q[at] * R[a, 2]
        else:
            x, y, z, w = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
            for a in range(3):
                r0, r1, r2 = R[a, 0], R[a, 1], R[a, 2]
                p[a] += r0 * q[at] + r1 * q[at + 1] + r2 * q[at + 2]
                R[a, 0] = (
                    r0 * (1 - 2 * (y * y + z * z))
                    + r1 * 2 * (x * y + w * z)
                    + r2 * 2 * (x * z - w * y)
                )
                R[a, 1] = (
                    r0 * 2 * (x * y - w * z)
                    + r1 * (1 - 2 * (x * x + z * z))
                    + r2 * 2 * (y * z + w * x)
                )
                R[a, 2] = (
                    r0 * 2 * (x * z + w * y)
                    + r1 * 2 * (y * z - w * x)
                    + r2 * (1 - 2 * (x * x + y * y))
                )


@compiled
def joint_axes(tree: Tree, rotation: Floats, translation: Floats, axes: Floats) -> None:
    """Write the twist of each degree of freedom at unit rate, (n, 6), in world axes.

    Linear velocity of the point at the world's origin (m per unit), then angular
    velocity: a point p moves with ``linear + angular x p``. A free flyer's six rates
    are linear and angular velocity in its own frame.
    """
    for j in range(len(tree.kind)):
        at = tree.first_v[j]
        R, p = rotation[j], translation[j]
        if tree.kind[j] == REVOLUTE:
            _turning(R, p, 2, axes[at])
        elif tree.kind[j] == PRISMATIC:
            _sliding(R, 2, axes[at])
        else:
            for k in range(3):
                _sliding(R, k, axes[at + k])
                _turning(R, p, k, axes[at + 3 + k])


@compiled
def _sliding(R: Floats, k: int, twist: Floats) -> None:
    for a in range(3):
        twist[a] = R[a, k]
        twist[3 + a] = 0.0


@compiled
def _turning(R: Floats, p: Floats, k: int, twist: Floats) -> None:
    x, y, z = R[0, k], R[1, k], R[2, k]
    twist[0] = p[1] * z - p[2] * y
    twist[1] = p[2] * x - p[0] * z
    twist[2] = p[0] * y - p[1] * x
    twist[3], twist[4], twist[5] = x, y, z
