"""A tree of joints as arrays, and the poses of its joints.

Every joint's frame is turned so that its axis is z. The pose of joint i in the world is
that of its parent, times its fixed placement there, times its own motion: a turn about
z (revolute), a shift along z (prismatic) or any pose (free flyer, seven numbers of q:
position and unit quaternion x, y, z, w).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.sine_cosine import sine_cosine
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array, Indices

REVOLUTE, PRISMATIC, FREE_FLYER = 0, 1, 2
#: Not a plain 2, for which numba would compile another version of its callees.
_Z = np.int64(2)


class Tree(NamedTuple):
    """J joints with n degrees of freedom, parents before children."""

    kind: Indices  # (J,) REVOLUTE, PRISMATIC or FREE_FLYER
    parent: Indices  # (J,) joint that carries this one; -1 is the world
    first_q: Indices  # (J,) first entry of the joint in q
    first_v: Indices  # (J,) and in v
    rotation: Array  # (J, 3, 3) the joint's placement in its parent's frame
    translation: Array  # (J, 3) m


@borrowing
def place_joints(tree: Tree, q: Array, rotation: Array, translation: Array) -> None:
    """Write the joints' poses in the world, (J, 3, 3) and (J, 3) m."""
    for j in range(len(tree.kind)):
        place_joint(tree, j, q, rotation, translation)


@inner_borrowing
def place_joint(
    tree: Tree, j: int, q: Array, rotation: Array, translation: Array
) -> None:
    """Write the pose of joint `j` from that of its parent."""
    parent, at, kind = tree.parent[j], tree.first_q[j], tree.kind[j]
    c, s, shift = 1.0, 0.0, 0.0
    if kind == REVOLUTE:
        s, c = sine_cosine(q[at])
    elif kind == PRISMATIC:
        shift = q[at]
    # Entries and not slices: counting references to a slice takes longer than this.
    for a in range(3):
        if parent < 0:
            r0, r1 = tree.rotation[j, a, 0], tree.rotation[j, a, 1]
            r2 = tree.rotation[j, a, 2]
            p = tree.translation[j, a]
        else:
            u0, u1 = rotation[parent, a, 0], rotation[parent, a, 1]
            u2 = rotation[parent, a, 2]
            r0 = u0 * tree.rotation[j, 0, 0] + u1 * tree.rotation[j, 1, 0]
            r1 = u0 * tree.rotation[j, 0, 1] + u1 * tree.rotation[j, 1, 1]
            r2 = u0 * tree.rotation[j, 0, 2] + u1 * tree.rotation[j, 1, 2]
            r0 += u2 * tree.rotation[j, 2, 0]
            r1 += u2 * tree.rotation[j, 2, 1]
            r2 += u2 * tree.rotation[j, 2, 2]
            p = u0 * tree.translation[j, 0] + u1 * tree.translation[j, 1]
            p += u2 * tree.translation[j, 2] + translation[parent, a]
        rotation[j, a, 0], rotation[j, a, 1] = c * r0 + s * r1, c * r1 - s * r0
        rotation[j, a, 2] = r2
        translation[j, a] = p + shift * r2
    if kind == FREE_FLYER:
        x, y, z, w = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
        for a in range(3):
            r0, r1, r2 = rotation[j, a, 0], rotation[j, a, 1], rotation[j, a, 2]
            translation[j, a] += r0 * q[at] + r1 * q[at + 1] + r2 * q[at + 2]
            rotation[j, a, 0] = (
                r0 * (1 - 2 * (y * y + z * z))
                + r1 * 2 * (x * y + w * z)
                + r2 * 2 * (x * z - w * y)
            )
            rotation[j, a, 1] = (
                r0 * 2 * (x * y - w * z)
                + r1 * (1 - 2 * (x * x + z * z))
                + r2 * 2 * (y * z + w * x)
            )
            rotation[j, a, 2] = (
                r0 * 2 * (x * z + w * y)
                + r1 * 2 * (y * z - w * x)
                + r2 * (1 - 2 * (x * x + y * y))
            )


@borrowing
def joint_axes(tree: Tree, rotation: Array, translation: Array, axes: Array) -> None:
    """Write the twist of each degree of freedom at unit rate, (n, 6), in world axes.

    Linear velocity of the point at the world's origin (m per unit), then angular
    velocity: a point p moves with ``linear + angular x p``. A free flyer's six rates
    are linear and angular velocity in its own frame.
    """
    for j in range(len(tree.kind)):
        kind, at = tree.kind[j], tree.first_v[j]
        if kind == FREE_FLYER:
            for k in range(6):
                turning = REVOLUTE if k >= 3 else PRISMATIC
                _axis(rotation, translation, j, k % 3, turning, axes, at + k)
        else:
            _axis(rotation, translation, j, _Z, kind, axes, at)


@borrowing
def _axis(
    rotation: Array, translation: Array, j: int, k: int, kind: int, axes: Array, d: int
) -> None:
    """Write the twist along (prismatic) or about axis k of joint j in row d."""
    x, y, z = rotation[j, 0, k], rotation[j, 1, k], rotation[j, 2, k]
    if kind == PRISMATIC:
        axes[d, 0], axes[d, 1], axes[d, 2] = x, y, z
        axes[d, 3], axes[d, 4], axes[d, 5] = 0.0, 0.0, 0.0
    else:
        p0, p1, p2 = translation[j, 0], translation[j, 1], translation[j, 2]
        axes[d, 0], axes[d, 1], axes[d, 2] = (
            p1 * z - p2 * y,
            p2 * x - p0 * z,
            p0 * y - p1 * x,
        )
        axes[d, 3], axes[d, 4], axes[d, 5] = x, y, z
