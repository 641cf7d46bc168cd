"""Gradient and Hessian of half the weighted squared marker errors, by the joints.

With r = x - seen, the error of a marker at x, and each degree of freedom a twist
(v, w) that moves x at v + w x x (x seen from one origin for all),

    gradient_j      = sum_m weight_m (v_j + w_j x x) . r
    Gauss-Newton_ij = sum_m weight_m (v_i + w_i x x) . (v_j + w_j x x)
    curvature_ij    = sum_m weight_m (w_i x (v_j + w_j x x)) . r     where i carries j

over the markers that j carries. All three follow from sums over these markers, which
are accumulated from the leaves to the root (weights take the place of masses in the
composite-rigid-body algorithm; Featherstone 2008, Rigid Body Dynamics Algorithms,
chapter 6):

    m = sum weight     h = sum weight x     C = sum weight x x'
    f = sum weight r   B = sum weight x r'

Of the six degrees of freedom of a free flyer, whose step is one exponential, none
carries the other: there the curvature is the mean of both orders.
"""

from __future__ import annotations

from ikns._kernels.body.tree import FREE_FLYER, Tree
from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices

#: m, h (3), f (3), C (6: xx yy zz yz zx xy), B (9, row after row).
MOMENTS = 22


@compiled
def linearize(
    tree: Tree,
    path: Indices,
    depth: Indices,
    axes: Array,
    marker_joint: Indices,
    weight: Array,
    x: Array,
    r: Array,
    moments: Array,
    forces: Array,
    gradient: Array,
    hessian: Array,
    curvature: Array,
) -> None:
    """Write gradient (n,), Gauss-Newton Hessian and curvature (n, D).

    Of the matrices, entry a of row d stands for column ``path[d, a]``, as in
    :mod:`ikns._kernels.body.tree_cholesky`. `x` and `r` are (M, 3), `axes` (n, 6);
    `moments` (J, 22) and `forces` (n, 9) are scratch.
    """
    _sum_moments(tree, marker_joint, weight, x, r, moments)
    for j in range(len(tree.kind)):
        first = tree.first_v[j]
        free = tree.kind[j] == FREE_FLYER
        for d in range(first, first + (6 if free else 1)):
            gradient[d] = _forces(moments, j, axes, forces, d)
            f0, f1, f2 = forces[d, 0], forces[d, 1], forces[d, 2]
            f3, f4, f5 = forces[d, 3], forces[d, 4], forces[d, 5]
            k0, k1, k2 = forces[d, 6], forces[d, 7], forces[d, 8]
            for a in range(depth[d] + 1):
                i = path[d, a]
                w0, w1, w2 = axes[i, 3], axes[i, 4], axes[i, 5]
                turning = w0 * k0 + w1 * k1 + w2 * k2
                if free and i >= first:
                    for k in range(3):
                        turning += axes[d, 3 + k] * forces[i, 6 + k]
                    turning /= 2
                hessian[d, a] = (
                    axes[i, 0] * f0
                    + axes[i, 1] * f1
                    + axes[i, 2] * f2
                    + w0 * f3
                    + w1 * f4
                    + w2 * f5
                )
                curvature[d, a] = turning


@compiled
def _sum_moments(
    tree: Tree, marker_joint: Indices, weight: Array, x: Array, r: Array, moments: Array
) -> None:
    for j in range(len(moments)):
        for k in range(MOMENTS):
            moments[j, k] = 0.0
    for m in range(len(weight)):
        w = weight[m]
        if w == 0:
            continue
        j = marker_joint[m]
        x0, x1, x2 = x[m, 0], x[m, 1], x[m, 2]
        r0, r1, r2 = w * r[m, 0], w * r[m, 1], w * r[m, 2]
        moments[j, 0] += w
        moments[j, 1] += w * x0
        moments[j, 2] += w * x1
        moments[j, 3] += w * x2
        moments[j, 4] += r0
        moments[j, 5] += r1
        moments[j, 6] += r2
        moments[j, 7] += w * x0 * x0
        moments[j, 8] += w * x1 * x1
        moments[j, 9] += w * x2 * x2
        moments[j, 10] += w * x1 * x2
        moments[j, 11] += w * x2 * x0
        moments[j, 12] += w * x0 * x1
        moments[j, 13] += x0 * r0
        moments[j, 14] += x0 * r1
        moments[j, 15] += x0 * r2
        moments[j, 16] += x1 * r0
        moments[j, 17] += x1 * r1
        moments[j, 18] += x1 * r2
        moments[j, 19] += x2 * r0
        moments[j, 20] += x2 * r1
        moments[j, 21] += x2 * r2
    for j in range(len(moments) - 1, -1, -1):
        if tree.parent[j] >= 0:
            for k in range(MOMENTS):
                moments[tree.parent[j], k] += moments[j, k]


@compiled
def _forces(moments: Array, j: int, axes: Array, forces: Array, d: int) -> float:
    """Write the forces of degree of freedom d of joint j; return its gradient.

    Forces are sum weight u (3) and sum weight x x u (3) for the velocity u = v + w x x,
    then sum weight u x r (3).
    """
    v0, v1, v2 = axes[d, 0], axes[d, 1], axes[d, 2]
    w0, w1, w2 = axes[d, 3], axes[d, 4], axes[d, 5]
    m, h0, h1, h2 = moments[j, 0], moments[j, 1], moments[j, 2], moments[j, 3]
    f0, f1, f2 = moments[j, 4], moments[j, 5], moments[j, 6]
    xx, yy, zz = moments[j, 7], moments[j, 8], moments[j, 9]
    yz, zx, xy = moments[j, 10], moments[j, 11], moments[j, 12]
    b00, b01, b02 = moments[j, 13], moments[j, 14], moments[j, 15]
    b10, b11, b12 = moments[j, 16], moments[j, 17], moments[j, 18]
    b20, b21, b22 = moments[j, 19], moments[j, 20], moments[j, 21]
    forces[d, 0] = m * v0 + w1 * h2 - w2 * h1
    forces[d, 1] = m * v1 + w2 * h0 - w0 * h2
    forces[d, 2] = m * v2 + w0 * h1 - w1 * h0
    # sum x x (w x x) = (trace(C) - C) w
    forces[d, 3] = h1 * v2 - h2 * v1 + (yy + zz) * w0 - xy * w1 - zx * w2
    forces[d, 4] = h2 * v0 - h0 * v2 + (zz + xx) * w1 - xy * w0 - yz * w2
    forces[d, 5] = h0 * v1 - h1 * v0 + (xx + yy) * w2 - zx * w0 - yz * w1
    # sum (w x x) x r = (B - trace(B)) w
    forces[d, 6] = v1 * f2 - v2 * f1 + b01 * w1 + b02 * w2 - (b11 + b22) * w0
    forces[d, 7] = v2 * f0 - v0 * f2 + b10 * w0 + b12 * w2 - (b00 + b22) * w1
    forces[d, 8] = v0 * f1 - v1 * f0 + b20 * w0 + b21 * w1 - (b00 + b11) * w2
    # sum x x r is the antisymmetric part of B.
    return (
        v0 * f0
        + v1 * f1
        + v2 * f2
        + w0 * (b12 - b21)
        + w1 * (b20 - b02)
        + w2 * (b01 - b10)
    )
