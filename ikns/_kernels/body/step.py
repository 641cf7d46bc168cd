"""Steps of a tree of joints, and the displacement between two configurations.

A revolute or prismatic joint's step is added. A free flyer at the pose (R, p) moved by
the twist (v, w) in its own frame goes to (R exp(w), p + R V(w) v), with t = |w|,

    V(w) = 1 + a [w] + b [w]^2,      a = (1 - cos t) / t^2,  b = (t - sin t) / t^3

(Murray, Li and Sastry 1994, A Mathematical Introduction to Robotic Manipulation,
equations 2.14 and 2.36), [w] the matrix of the cross product.

The displacement from (R0, p0) to (R, p) is (R'(p - p0), log(R0' R)): its square is the
squared shift plus the squared angle, and it is itself half that square's gradient.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.tree import FREE_FLYER, Tree
from ikns._kernels.compiled import borrowing
from ikns.arrays import Array

#: Below this angle the series are exact to rounding with three terms: t^6 / 10^5.
_SMALL = 1e-2


@borrowing
def integrate(tree: Tree, q: Array, step: Array, moved: Array) -> None:
    """Write the configuration after `step` (n,) from `q` into `moved`."""
    for j in range(len(tree.kind)):
        at, first = tree.first_q[j], tree.first_v[j]
        if tree.kind[j] == FREE_FLYER:
            _integrate_pose(q, at, step, first, moved)
        else:
            moved[at] = q[at] + step[first]


@borrowing
def displacement(tree: Tree, q0: Array, q: Array, moved: Array) -> None:
    """Write the displacement from `q0` to `q`, (n,)."""
    for j in range(len(tree.kind)):
        at, first = tree.first_q[j], tree.first_v[j]
        if tree.kind[j] == FREE_FLYER:
            _pose_displacement(q0, q, at, moved, first)
        else:
            moved[first] = q[at] - q0[at]


@borrowing
def _integrate_pose(q: Array, at: int, step: Array, i: int, moved: Array) -> None:
    vx, vy, vz = step[i], step[i + 1], step[i + 2]
    wx, wy, wz = step[i + 3], step[i + 4], step[i + 5]
    square = wx * wx + wy * wy + wz * wz
    t = np.sqrt(square)
    if t < _SMALL:
        half = 0.5 - square / 48 + square * square / 3840  # sin(t / 2) / t
        a = 0.5 - square / 24 + square * square / 720
        b = 1 / 6 - square / 120 + square * square / 5040
    else:
        half = np.sin(t / 2) / t
        a = (1 - np.cos(t)) / square
        b = (t - np.sin(t)) / (square * t)
    cx, cy, cz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    dx = vx + a * cx + b * (wy * cz - wz * cy)
    dy = vy + a * cy + b * (wz * cx - wx * cz)
    dz = vz + a * cz + b * (wx * cy - wy * cx)
    x, y, z, w = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
    dx, dy, dz = _turned(x, y, z, w, dx, dy, dz)
    sx, sy, sz, sw = half * wx, half * wy, half * wz, np.cos(t / 2)
    nx = w * sx + x * sw + y * sz - z * sy
    ny = w * sy - x * sz + y * sw + z * sx
    nz = w * sz + x * sy - y * sx + z * sw
    nw = w * sw - x * sx - y * sy - z * sz
    size = np.sqrt(nx * nx + ny * ny + nz * nz + nw * nw)
    moved[at], moved[at + 1], moved[at + 2] = q[at] + dx, q[at + 1] + dy, q[at + 2] + dz
    moved[at + 3], moved[at + 4] = nx / size, ny / size
    moved[at + 5], moved[at + 6] = nz / size, nw / size


@borrowing
def _pose_displacement(q0: Array, q: Array, at: int, moved: Array, i: int) -> None:
    x, y, z, w = q0[at + 3], q0[at + 4], q0[at + 5], q0[at + 6]
    u1, u2, u3, u0 = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
    rx = w * u1 - x * u0 - y * u3 + z * u2
    ry = w * u2 + x * u3 - y * u0 - z * u1
    rz = w * u3 - x * u2 + y * u1 - z * u0
    rw = w * u0 + x * u1 + y * u2 + z * u3
    # Of the two quaternions of a rotation, the one with the smaller angle.
    if rw < 0:
        rx, ry, rz, rw = -rx, -ry, -rz, -rw
    sine = np.sqrt(rx * rx + ry * ry + rz * rz)
    t = 2 * np.arctan2(sine, rw)
    # t / sin(t / 2)
    stretch = t / sine if t > _SMALL else 2 + t**2 / 12 + 7 * t**4 / 2880
    px, py, pz = q[at] - q0[at], q[at + 1] - q0[at + 1], q[at + 2] - q0[at + 2]
    moved[i], moved[i + 1], moved[i + 2] = _turned(-u1, -u2, -u3, u0, px, py, pz)
    moved[i + 3], moved[i + 4] = stretch * rx, stretch * ry
    moved[i + 5] = stretch * rz


@borrowing
def _turned(
    x: float, y: float, z: float, w: float, a: float, b: float, c: float
) -> tuple[float, float, float]:
    """Rotate the vector (a, b, c) by a unit quaternion."""
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return (
        a + w * tx + y * tz - z * ty,
        b + w * ty + z * tx - x * tz,
        c + w * tz + x * ty - y * tx,
    )
