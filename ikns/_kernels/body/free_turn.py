"""Clusters of markers that turn about a joint's axis by an angle of their own.

Skin over the forearm follows pronation in part only. Markers on it are placed in the
frame of the joint (its axis is z), turned together by the angle that brings them
nearest to where they were seen,

    atan2(sum weight (p x s)_z, sum weight (p . s)_xy)      p placed, s seen there

whatever the joint's own angle. So they say nothing about that, and the frame has no
unknown more: the best angle is put in, and taken out of the Hessian (its Schur
complement; the gradient does not change, as the cost's slope along it is zero).
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.tree import Tree
from ikns._kernels.compiled import inner
from ikns.arrays import Array, Indices


@inner
def turn_clusters(
    turn_joint: Indices,
    marker_turn: Indices,
    position: Array,
    weight: Array,
    target: Array,
    origin: Array,
    rotation: Array,
    translation: Array,
    turned: Array,
) -> None:
    """Write the turned positions (M, 3) of the clusters' markers in their joint.

    Cluster k belongs to joint ``turn_joint[k]``; ``marker_turn`` (M,) is the cluster of
    each marker, or -1. Joints are placed relative to `origin`.
    """
    for k in range(len(turn_joint)):
        j, across, along = turn_joint[k], 0.0, 0.0
        for m in range(len(weight)):
            if marker_turn[m] != k or weight[m] == 0:
                continue
            x = y = 0.0
            for a in range(3):
                seen = target[m, a] - origin[a] - translation[j, a]
                x += rotation[j, a, 0] * seen
                y += rotation[j, a, 1] * seen
            across += weight[m] * (position[m, 0] * y - position[m, 1] * x)
            along += weight[m] * (position[m, 0] * x + position[m, 1] * y)
        length = np.hypot(across, along)
        c = along / length if length > 0 else 1.0
        s = across / length if length > 0 else 0.0
        for m in range(len(weight)):
            if marker_turn[m] == k:
                turned[m, 0] = c * position[m, 0] - s * position[m, 1]
                turned[m, 1] = s * position[m, 0] + c * position[m, 1]
                turned[m, 2] = position[m, 2]


@inner
def release_clusters(
    tree: Tree,
    path: Indices,
    depth: Indices,
    axes: Array,
    turn_joint: Indices,
    marker_turn: Indices,
    weight: Array,
    x: Array,
    r: Array,
    row: Array,
    hessian: Array,
    curvature: Array,
) -> None:
    """Take the clusters' angles out of Gauss-Newton Hessian and curvature, (n, D).

    They hold the clusters' markers as carried by the joint before, turned as above;
    see :mod:`ikns._kernels.body.normal_equations` for the rest. `row` (n, 2 or more) is
    scratch.
    """
    for k in range(len(turn_joint)):
        d = tree.first_v[turn_joint[k]]
        before = tree.dof_parent[d]
        f0 = f1 = f2 = t0 = t1 = t2 = g0 = g1 = g2 = 0.0
        v0, v1, v2 = axes[d, 0], axes[d, 1], axes[d, 2]
        w0, w1, w2 = axes[d, 3], axes[d, 4], axes[d, 5]
        for m in range(len(weight)):
            w = weight[m]
            if marker_turn[m] != k or w == 0:
                continue
            x0, x1, x2 = x[m, 0], x[m, 1], x[m, 2]
            u0 = w * (v0 + w1 * x2 - w2 * x1)
            u1 = w * (v1 + w2 * x0 - w0 * x2)
            u2 = w * (v2 + w0 * x1 - w1 * x0)
            f0, f1, f2 = f0 + u0, f1 + u1, f2 + u2
            t0 += x1 * u2 - x2 * u1
            t1 += x2 * u0 - x0 * u2
            t2 += x0 * u1 - x1 * u0
            g0 += u1 * r[m, 2] - u2 * r[m, 1]
            g1 += u2 * r[m, 0] - u0 * r[m, 2]
            g2 += u0 * r[m, 1] - u1 * r[m, 0]
        own = v0 * f0 + v1 * f1 + v2 * f2 + w0 * t0 + w1 * t1 + w2 * t2
        bent = own + w0 * g0 + w1 * g1 + w2 * g2
        # Without a marker in sight, or with markers on the axis, nothing is turned; far
        # from a minimum the true curvature may vanish.
        if before < 0 or not own > 0 or not bent > 1e-3 * own:
            continue
        for a in range(depth[before] + 1):
            i = path[before, a]
            row[i, 0] = axes[i, 0] * f0 + axes[i, 1] * f1 + axes[i, 2] * f2
            row[i, 0] += axes[i, 3] * t0 + axes[i, 4] * t1 + axes[i, 5] * t2
            row[i, 1] = axes[i, 3] * g0 + axes[i, 4] * g1 + axes[i, 5] * g2
            for b in range(a + 1):
                e = path[before, b]
                gauss_newton = row[i, 0] * row[e, 0] / own
                true = (row[i, 0] + row[i, 1]) * (row[e, 0] + row[e, 1]) / bent
                hessian[i, b] -= gauss_newton
                curvature[i, b] -= true - gauss_newton
