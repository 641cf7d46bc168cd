"""A tree of joints as arrays, and the poses of its joints.

Every joint's frame is turned so that its axis is z. The pose of joint i in the world is
that of its parent, times its fixed placement there, times its own motion: a turn about
z (revolute), a shift along z (prismatic) or any pose (free flyer, seven numbers of q:
position and unit quaternion x, y, z, w).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.sine_cosine import sines_cosines
from ikns._kernels.compiled import borrowing
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
def place_joints(
    tree: Tree, q: Array, turns: Array, rotation: Array, translation: Array
) -> None:
    """Write the joints' poses in the world, (J, 3, 3) and (J, 3) m.

    `turns` (2, nq) is scratch.
    """
    R, p = tree.rotation, tree.translation
    sines_cosines(q, turns)
    # In one function: passing so many arrays on for each joint takes as long.
    for j in range(len(tree.kind)):
        parent, at, kind = tree.parent[j], tree.first_q[j], tree.kind[j]
        # Entries and not slices: counting references to a slice takes longer than this.
        # Its placement in the parent's frame,
        a00, a01, a02 = R[j, 0, 0], R[j, 0, 1], R[j, 0, 2]
        a10, a11, a12 = R[j, 1, 0], R[j, 1, 1], R[j, 1, 2]
        a20, a21, a22 = R[j, 2, 0], R[j, 2, 1], R[j, 2, 2]
        p0, p1, p2 = p[j, 0], p[j, 1], p[j, 2]
        # moved by the joint itself,
        if kind == REVOLUTE:
            s, c = turns[0, at], turns[1, at]
            a00, a01 = c * a00 + s * a01, c * a01 - s * a00
            a10, a11 = c * a10 + s * a11, c * a11 - s * a10
            a20, a21 = c * a20 + s * a21, c * a21 - s * a20
        else:
            x, y, z = 0.0, 0.0, q[at]
            if kind == FREE_FLYER:
                x, y, z = q[at], q[at + 1], q[at + 2]
            p0 += a00 * x + a01 * y + a02 * z
            p1 += a10 * x + a11 * y + a12 * z
            p2 += a20 * x + a21 * y + a22 * z
        if kind == FREE_FLYER:
            a00, a01, a02 = _turned_row(a00, a01, a02, q, at + 3)
            a10, a11, a12 = _turned_row(a10, a11, a12, q, at + 3)
            a20, a21, a22 = _turned_row(a20, a21, a22, q, at + 3)
        # and in the world.
        for a in range(3):
            if parent >= 0:
                u0, u1 = rotation[parent, a, 0], rotation[parent, a, 1]
                u2, shift = rotation[parent, a, 2], translation[parent, a]
            else:
                u0, u1 = 1.0 if a == 0 else 0.0, 1.0 if a == 1 else 0.0
                u2, shift = 1.0 if a == 2 else 0.0, 0.0
            rotation[j, a, 0] = u0 * a00 + u1 * a10 + u2 * a20
            rotation[j, a, 1] = u0 * a01 + u1 * a11 + u2 * a21
            rotation[j, a, 2] = u0 * a02 + u1 * a12 + u2 * a22
            translation[j, a] = u0 * p0 + u1 * p1 + u2 * p2 + shift


@borrowing
def _turned_row(
    r0: float, r1: float, r2: float, q: Array, at: int
) -> tuple[float, float, float]:
    """Return a row of a rotation matrix times that of the quaternion in `q`."""
    x, y, z, w = q[at], q[at + 1], q[at + 2], q[at + 3]
    return (
        r0 * (1 - 2 * (y * y + z * z))
        + r1 * 2 * (x * y + w * z)
        + r2 * 2 * (x * z - w * y),
        r0 * 2 * (x * y - w * z)
        + r1 * (1 - 2 * (x * x + z * z))
        + r2 * 2 * (y * z + w * x),
        r0 * 2 * (x * z + w * y)
        + r1 * 2 * (y * z - w * x)
        + r2 * (1 - 2 * (x * x + y * y)),
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
