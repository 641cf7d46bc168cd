"""Bring a frame at the end of a path to a pose, by Newton's method.

Each step is the shortest change of the joints by which the pose error would vanish,
``J' (J J')^-1 error``, so that nothing moves along the self-motion (Siciliano et al.
2009, Robotics, sec. 3.5).
"""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.body.paths import Paths, follow_path, path_jacobian
from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array, Indices

#: Most steps.
_STEPS = 50


@inner
def reach_pose(
    paths: Paths,
    columns: Indices,
    position: Array,
    rotation: Array,
    tolerance: float,
    longest: float,
    angles: Array,
) -> bool:
    """Change `angles` (n,) so that the first path's frame is at a pose.

    Parameters
    ----------
    paths : Paths
        With the `columns` of the angles in their order as columns of the Jacobian.
    columns : (k,) integer array
        Of the angles that may change.
    position, rotation : (3,) and (3, 3) array
        In the base, m.
    tolerance : float
        Largest error of an axis, m and rad.
    longest : float
        Largest change of a joint in a step, rad.

    Returns
    -------
    bool
        False where it cannot be reached.
    """
    R, p = np.empty((3, 3)), np.empty(3)
    axes = np.empty((len(paths.joint), 6))
    k = len(columns)
    J, H, error = np.zeros((6, k)), np.empty((6, 6)), np.empty(6)
    step = np.empty(k)
    for _ in range(_STEPS):
        follow_path(paths, 0, angles, R, p, axes)
        _write_error(R, p, rotation, position, error)
        worst = 0.0
        for a in range(6):
            worst = max(worst, abs(error[a]))
        if worst < tolerance:
            return True
        path_jacobian(paths, 0, p, axes, 6, J)
        for a in range(6):
            for b in range(a + 1):
                total = 0.0
                for j in range(k):
                    total += J[a, j] * J[b, j]
                H[a, b] = total
        if not _solve(H, error):
            return False
        largest = 0.0
        for j in range(k):
            total = 0.0
            for a in range(6):
                total += J[a, j] * error[a]
            step[j] = total
            largest = max(largest, abs(total))
        scale = min(1.0, longest / largest)
        for j in range(k):
            angles[columns[j]] += scale * step[j]
    return False


@compiled
def reach_poses(
    paths: Paths,
    columns: Indices,
    position: Array,
    rotation: Array,
    tolerance: float,
    longest: float,
    angles: Array,
) -> int:
    """Do so in each of N rows; return the first that cannot be reached, or -1."""
    for i in range(len(angles)):
        if not reach_pose(
            paths, columns, position[i], rotation[i], tolerance, longest, angles[i]
        ):
            return i
    return -1


@compiled
def _write_error(
    R: Array, p: Array, rotation: Array, position: Array, error: Array
) -> None:
    """Write how far a pose is from the goal, (6,) m and rad.

    The turn is half the skew part of ``rotation R'``, which is exact to first order.
    """
    D = np.empty((3, 3))
    for a in range(3):
        error[a] = position[a] - p[a]
        for b in range(3):
            D[a, b] = (
                rotation[a, 0] * R[b, 0]
                + rotation[a, 1] * R[b, 1]
                + rotation[a, 2] * R[b, 2]
            )
    error[3] = (D[2, 1] - D[1, 2]) / 2
    error[4] = (D[0, 2] - D[2, 0]) / 2
    error[5] = (D[1, 0] - D[0, 1]) / 2


@compiled
def _solve(H: Array, x: Array) -> bool:
    """Solve with a symmetric H, given and factored in its lower half, in place."""
    n = len(x)
    for a in range(n):
        for b in range(a + 1):
            total = H[a, b]
            for c in range(b):
                total -= H[a, c] * H[b, c]
            if b < a:
                H[a, b] = total / H[b, b]
            elif total > 0:  # a NaN is not either
                H[a, a] = math.sqrt(total)
            else:
                return False
    for a in range(n):
        for c in range(a):
            x[a] -= H[a, c] * x[c]
        x[a] /= H[a, a]
    for a in range(n - 1, -1, -1):
        for c in range(a + 1, n):
            x[a] -= H[c, a] * x[c]
        x[a] /= H[a, a]
    return True
