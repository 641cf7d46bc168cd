"""Poses and Jacobians of frames, from the joints between the base and each frame.

Along a path the pose is a product of fixed placements and of turns about (or shifts
along) each joint's z. A joint with axis z and origin p moves the frame at x by the
columns ``[z x (x - p); z]`` (revolute) or ``[z; 0]`` (prismatic), m and rad per unit
(Siciliano et al. 2009, Robotics, sec. 3.1).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.tree import PRISMATIC
from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array, Indices


class Paths(NamedTuple):
    """Paths from one base to E frames, concatenated; K joints in total.

    A joint is its kind (:data:`ikns._kernels.body.tree.REVOLUTE` or ``PRISMATIC``), its
    column of the angles and its column of the Jacobian (-1 for none). Placements are of
    each joint on the one before it, then of each frame on the last joint of its path.
    """

    ends: Indices  # (E,) end of each path among the K joints
    joint: Indices  # (K, 3)
    rotation: Array  # (K + E, 3, 3)
    translation: Array  # (K + E, 3) m


@inner
def follow_path(
    paths: Paths, e: int, angles: Array, R: Array, p: Array, axes: Array
) -> None:
    """Write pose e in the base, (3, 3) and (3,) m, and its joints' z and origin.

    `axes` is (K, 6).
    """
    for a in range(3):
        p[a] = 0.0
        for b in range(3):
            R[a, b] = 1.0 if a == b else 0.0
    for k in range(paths.ends[e - 1] if e > 0 else 0, paths.ends[e]):
        _carry(paths, k, R, p)
        angle = angles[paths.joint[k, 1]]
        if paths.joint[k, 0] == PRISMATIC:
            for a in range(3):
                p[a] += angle * R[a, 2]
        else:
            c, s = math.cos(angle), math.sin(angle)
            for a in range(3):
                x, y = R[a, 0], R[a, 1]
                R[a, 0] = c * x + s * y
                R[a, 1] = c * y - s * x
        for a in range(3):
            axes[k, a] = R[a, 2]
            axes[k, 3 + a] = p[a]
    _carry(paths, len(paths.joint) + e, R, p)


@inner
def path_jacobian(
    paths: Paths, e: int, p: Array, axes: Array, rows: int, jacobian: Array
) -> None:
    """Write rows ``e * rows`` and on (3 or 6 of them), in the base's axes.

    `p` and `axes` as :func:`follow_path` writes them.
    """
    top = e * rows
    for k in range(paths.ends[e - 1] if e > 0 else 0, paths.ends[e]):
        column = paths.joint[k, 2]
        if column < 0:
            continue
        x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
        turns = 1.0
        if paths.joint[k, 0] == PRISMATIC:
            turns = 0.0
            jacobian[top, column] = x
            jacobian[top + 1, column] = y
            jacobian[top + 2, column] = z
        else:
            dx, dy, dz = p[0] - axes[k, 3], p[1] - axes[k, 4], p[2] - axes[k, 5]
            jacobian[top, column] = y * dz - z * dy
            jacobian[top + 1, column] = z * dx - x * dz
            jacobian[top + 2, column] = x * dy - y * dx
        if rows == 6:
            jacobian[top + 3, column] = turns * x
            jacobian[top + 4, column] = turns * y
            jacobian[top + 5, column] = turns * z


@compiled
def place_frames(
    paths: Paths, angles: Array, rotation: Array, translation: Array
) -> None:
    """Write the poses for angles (N, n), (N, E, 3, 3) and (N, E, 3) m."""
    axes = np.empty((len(paths.joint), 6))
    for i in range(len(angles)):
        for e in range(len(paths.ends)):
            follow_path(paths, e, angles[i], rotation[i, e], translation[i, e], axes)


@compiled
def write_jacobians(paths: Paths, angles: Array, rows: int, jacobian: Array) -> None:
    """Write the Jacobians, (N, E * rows, n); columns without a joint stay as given."""
    axes = np.empty((len(paths.joint), 6))
    R, p = np.empty((3, 3)), np.empty(3)
    for i in range(len(angles)):
        for e in range(len(paths.ends)):
            follow_path(paths, e, angles[i], R, p, axes)
            path_jacobian(paths, e, p, axes, rows, jacobian[i])


@compiled
def _carry(paths: Paths, k: int, R: Array, p: Array) -> None:
    """Move the frame by placement k."""
    own, shift = paths.rotation[k], paths.translation[k]
    for a in range(3):
        x, y, z = R[a, 0], R[a, 1], R[a, 2]
        p[a] += x * shift[0] + y * shift[1] + z * shift[2]
        for b in range(3):
            R[a, b] = x * own[0, b] + y * own[1, b] + z * own[2, b]
