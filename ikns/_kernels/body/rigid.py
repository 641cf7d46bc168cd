"""The rotation and shift that carry points onto points best, as a pose.

The unit quaternion is the eigenvector with the largest eigenvalue of a symmetric 4 x 4
matrix of the points' products (Horn 1987, Closed-form solution of absolute orientation
using unit quaternions, J. Opt. Soc. Am. A 4: 629). The eigenvectors come from Jacobi's
rotations (Golub and Van Loan, Matrix Computations, section 8.5).
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import borrowing
from ikns.arrays import Array


@borrowing
def rigid_pose(
    source: Array, target: Array, weight: Array, N: Array, V: Array, pose: Array
) -> None:
    """Write the pose (7,) that carries `source` onto `target`, both (M, 3).

    Points of weight zero do not count, others all the same. `N` and `V` are (4, 4)
    scratch.
    """
    n = 0
    ax = ay = az = bx = by = bz = 0.0
    for m in range(len(source)):
        if weight[m] > 0:
            n += 1
            ax += source[m, 0]
            ay += source[m, 1]
            az += source[m, 2]
            bx += target[m, 0]
            by += target[m, 1]
            bz += target[m, 2]
    ax, ay, az, bx, by, bz = ax / n, ay / n, az / n, bx / n, by / n, bz / n
    xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
    for m in range(len(source)):
        if weight[m] > 0:
            x, y, z = source[m, 0] - ax, source[m, 1] - ay, source[m, 2] - az
            u, v, w = target[m, 0] - bx, target[m, 1] - by, target[m, 2] - bz
            xx += x * u
            xy += x * v
            xz += x * w
            yx += y * u
            yy += y * v
            yz += y * w
            zx += z * u
            zy += z * v
            zz += z * w
    # Order x, y, z, w.
    N[0, 0], N[1, 1], N[2, 2] = xx - yy - zz, yy - xx - zz, zz - xx - yy
    N[3, 3] = xx + yy + zz
    N[0, 1] = N[1, 0] = xy + yx
    N[0, 2] = N[2, 0] = zx + xz
    N[1, 2] = N[2, 1] = yz + zy
    N[0, 3] = N[3, 0] = yz - zy
    N[1, 3] = N[3, 1] = zx - xz
    N[2, 3] = N[3, 2] = xy - yx
    _diagonalize(N, V)
    best = 0
    for k in range(1, 4):
        if N[k, k] > N[best, best]:
            best = k
    x, y, z, w = V[0, best], V[1, best], V[2, best], V[3, best]
    pose[3], pose[4], pose[5], pose[6] = x, y, z, w
    tx, ty, tz = 2 * (y * az - z * ay), 2 * (z * ax - x * az), 2 * (x * ay - y * ax)
    pose[0] = bx - (ax + w * tx + y * tz - z * ty)
    pose[1] = by - (ay + w * ty + z * tx - x * tz)
    pose[2] = bz - (az + w * tz + x * ty - y * tx)


@borrowing
def _diagonalize(A: Array, V: Array) -> None:
    """Diagonalize a symmetric A (k, k) in place; write its eigenvectors as columns."""
    k = len(A)
    for i in range(k):
        for j in range(k):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(50):  # converges quadratically, in about six sweeps
        done = True
        for p in range(k - 1):
            for r in range(p + 1, k):
                # Too small to change either of the two entries on the diagonal.
                if abs(A[p, r]) <= 1e-17 * (abs(A[p, p]) + abs(A[r, r])):
                    continue
                done = False
                ratio = (A[r, r] - A[p, p]) / (2 * A[p, r])
                t = 1 / (abs(ratio) + np.sqrt(1 + ratio * ratio))
                t = -t if ratio < 0 else t
                c = 1 / np.sqrt(1 + t * t)
                s = t * c
                for i in range(k):
                    a, b = A[i, p], A[i, r]
                    A[i, p], A[i, r] = c * a - s * b, s * a + c * b
                for i in range(k):
                    a, b = A[p, i], A[r, i]
                    A[p, i], A[r, i] = c * a - s * b, s * a + c * b
                for i in range(k):
                    a, b = V[i, p], V[i, r]
                    V[i, p], V[i, r] = c * a - s * b, s * a + c * b
        if done:
            return
