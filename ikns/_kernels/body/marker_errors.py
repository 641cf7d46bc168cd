"""The cost of marker inverse kinematics and its gradient, term by term."""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.free_turn import turn_clusters
from ikns._kernels.body.step import displacement
from ikns._kernels.body.tree import Tree, place_joints
from ikns._kernels.compiled import inner_borrowing
from ikns.arrays import Array, Indices


@inner_borrowing
def take_markers(
    given: Array, seen: Array, weight: Array, target: Array
) -> tuple[int, bool]:
    """Copy the seen markers, which are those that are finite.

    Returns how many there are, and whether a marker is infinite.
    """
    n_seen, infinite = 0, False
    for m in range(len(seen)):
        total = 0.0
        for k in range(3):
            target[m, k] = seen[m, k]
            total += seen[m, k] - seen[m, k]
            infinite = infinite or np.isinf(seen[m, k])
        # Zero where all three are finite, NaN otherwise.
        weight[m] = given[m] if total == 0 else 0.0
        if weight[m] > 0:
            n_seen += 1
    return n_seen, infinite


@inner_borrowing
def marker_errors(
    tree: Tree,
    joint: Indices,
    marker_turn: Indices,
    turn_joint: Indices,
    position: Array,
    weight: Array,
    target: Array,
    q: Array,
    origin: Array,
    turns: Array,
    rotation: Array,
    translation: Array,
    x: Array,
    error: Array,
    turned: Array,
) -> tuple[float, float]:
    """Write joints and markers relative to the first joint, and the markers' errors.

    Clusters are turned; their markers' places in the joint are written too. Returns the
    sum of squared errors, weighted and unweighted.
    """
    place_joints(tree, q, turns, rotation, translation)
    for k in range(3):
        origin[k] = translation[0, k]
    for j in range(len(translation)):
        for k in range(3):
            translation[j, k] -= origin[k]
    turn_clusters(
        turn_joint,
        marker_turn,
        position,
        weight,
        target,
        origin,
        rotation,
        translation,
        turned,
    )
    weighted = plain = 0.0
    for m in range(len(weight)):
        if weight[m] > 0:
            j, square = joint[m], 0.0
            p0, p1, p2 = position[m, 0], position[m, 1], position[m, 2]
            if marker_turn[m] >= 0:
                p0, p1 = turned[m, 0], turned[m, 1]
            for k in range(3):
                x[m, k] = (
                    translation[j, k]
                    + rotation[j, k, 0] * p0
                    + rotation[j, k, 1] * p1
                    + rotation[j, k, 2] * p2
                )
                error[m, k] = x[m, k] - (target[m, k] - origin[k])
                square += error[m, k] ** 2
            plain += square
            weighted += weight[m] * square
    return weighted, plain


@inner_borrowing
def penalties(
    tree: Tree,
    angle: Indices,
    lower: Array,
    upper: Array,
    start: Array,
    pull: float,
    limit: float,
    q: Array,
    moved: Array,
    beyond: Array,
) -> float:
    """Write distances (n,) from the start and beyond the limits; return the cost."""
    displacement(tree, start, q, moved)
    cost = 0.0
    for i in range(len(moved)):
        over = 0.0
        if angle[i] >= 0:
            over = max(q[angle[i]] - upper[i], 0.0) + min(q[angle[i]] - lower[i], 0.0)
        beyond[i] = over
        cost += (pull * moved[i]) ** 2 + (limit * over) ** 2
    return cost


@inner_borrowing
def add_penalties(
    free: Array,
    pull: float,
    limit: float,
    moved: Array,
    beyond: Array,
    gradient: Array,
    extra: Array,
) -> None:
    """Add the penalties to the gradient (n,); write those of the Hessian's diagonal.

    Held joints have no gradient.
    """
    for d in range(len(extra)):
        gradient[d] += pull**2 * moved[d] + limit**2 * beyond[d]
        gradient[d] *= free[d]
        extra[d] = pull**2
        if beyond[d] != 0:
            extra[d] += limit**2
