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
from ikns._kernels.compiled import inner_borrowing
from ikns.arrays import Array, Indices


@inner_borrowing
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


@inner_borrowing
def release_clusters(
    tree: Tree,
    axes: Array,
    turn_joint: Indices,
    marker_turn: Indices,
    weight: Array,
    x: Array,
    r: Array,
    share: float,
    inertia: Array,
) -> None:
    """Take the clusters' angles out of A, (J, 21), of the joints before.

    That holds the clusters' markers as carried by the joint before, turned as above;
    see :mod:`ikns._kernels.body.articulated`, also for `share`.
    """
    for k in range(len(turn_joint)):
        d, before = tree.first_v[turn_joint[k]], tree.parent[turn_joint[k]]
        v0, v1, v2 = axes[d, 0], axes[d, 1], axes[d, 2]
        w0, w1, w2 = axes[d, 3], axes[d, 4], axes[d, 5]
        f0 = f1 = f2 = t0 = t1 = t2 = g0 = g1 = g2 = 0.0
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
        pivot = own + share * (bent - own)
        t0, t1, t2 = t0 + share * g0, t1 + share * g1, t2 + share * g2
        u, i = (f0, f1, f2, t0, t1, t2), 0
        for a in range(6):
            for b in range(a, 6):
                inertia[before, i] -= u[a] * u[b] / pivot
                i += 1
