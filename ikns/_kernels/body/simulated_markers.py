"""One frame of simulated cameras: the state of an arm, and the markers it wears."""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.tree import Tree, place_joints
from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices


@compiled
def write_cubic(knots: Array, coefficients: Array, x: float, values: Array) -> None:
    """Write a piecewise cubic at x, (C,), with the first and last piece beyond.

    `coefficients` (4, K - 1, C) as in :class:`scipy.interpolate.PPoly`, highest power
    first.
    """
    at = int(np.searchsorted(knots, x, side="right")) - 1
    piece = min(max(at, 0), len(knots) - 2)
    t = x - knots[piece]
    for c in range(len(values)):
        a, b = coefficients[0, piece, c], coefficients[1, piece, c]
        values[c] = ((a * t + b) * t + coefficients[2, piece, c]) * t + coefficients[
            3, piece, c
        ]


@compiled
def write_posture(columns: Indices, row: Array, drift: Array, q: Array) -> None:
    """Write the arm's joints to a configuration (25,).

    `row` begins with the arm's posture (9,) and the pseudo-inverse of its Jacobian
    (7, 6), by which the drift of the hand (6,), m and rad, moves all but its clavicle.
    """
    for j in range(len(columns)):
        at = 7 + columns[j]
        q[at] = row[j]
        if j >= 2:
            first = 9 + 6 * (j - 2)
            for a in range(6):
                q[at] += row[first + a] * drift[a]


@compiled
def write_markers(
    tree: Tree,
    q: Array,
    joint: Indices,
    in_joint: Array,
    skin: Array,
    to_world: Array,
    noise: Array,
    turns: Array,
    rotation: Array,
    translation: Array,
    markers: Array,
) -> None:
    """Write the markers (M, 3), m, at a configuration.

    `joint` (M,) carries each marker at `in_joint` (M, 3); `skin` (3 M,) is their
    displacement in the thorax, turned by `to_world` (3, 3); `noise` (M, 3) is added.
    `rotation` and `translation` get the poses of the joints; `turns` (2, nq) is
    scratch.
    """
    place_joints(tree, q, turns, rotation, translation)
    for m in range(len(joint)):
        j = joint[m]
        for a in range(3):
            total = translation[j, a] + noise[m, a]
            for b in range(3):
                total += rotation[j, a, b] * in_joint[m, b]
                total += to_world[a, b] * skin[3 * m + b]
            markers[m, a] = total
