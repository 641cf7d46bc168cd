"""The problem of marker inverse kinematics as arrays, and its scratch memory.

Passing an array from Python to a kernel takes a quarter of a microsecond, so a problem
is packed into one array of integers and one of reals and unpacked inside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.articulated import INERTIA, MOMENTS, ROW
from ikns._kernels.body.tree import Tree
from ikns._kernels.compiled import inner_borrowing
from ikns.arrays import Array, Indices

#: Integers before all others; the last two are how many integers and reals there are.
HEADER = 10


class MarkerProblem(NamedTuple):
    """What does not change between frames: n rates, M markers, S starts.

    The best start is chosen by limb, from 0 to ``n_branches - 1``. K clusters of
    markers turn about the axis of a joint by an angle of their own; see
    :mod:`ikns._kernels.body.free_turn`.
    """

    tree: Tree
    marker_joint: Indices  # (M,) joint of the tree that carries the marker
    marker_carrier: (
        Indices  # (M,) the joint that moves it: of a cluster, the one before
    )
    marker_turn: Indices  # (M,) cluster of each marker, or -1
    turn_joint: Indices  # (K,) joint about whose axis the cluster turns
    marker_position: Array  # (M, 3) in the frame of its joint, m
    marker_weight: Array  # (M,) zero for markers that are not used
    free: Array  # (n,) 1 for degrees of freedom to solve for, 0 for held ones
    angle: Indices  # (n,) entry of q that `lower` and `upper` limit, or -1
    lower: Array  # (n,) joint limit, rad or m
    upper: Array  # (n,)
    starts: Array  # (S, nq) configurations to start from without a previous pose
    marker_branch: Indices  # (M,) limb of each marker, or -1
    q_branch: Indices  # (nq,) limb of each entry of q, or -1
    n_branches: int
    max_iterations: int
    pull: float  # weights of the terms of the cost, m/rad
    pull_from_scratch: float
    limit: float
    tolerance: float  # converged when the next step moves every joint less, rad and m
    lost: float  # residual above which a frame is also tried from scratch, m


class Scratch(NamedTuple):
    """Scratch memory of a frame."""

    origin: Array
    rotation: Array
    translation: Array
    axes: Array
    weight: Array
    target: Array
    x: Array
    error: Array
    turned: Array
    best_x: Array  # x and error where the cost is lowest so far
    best_error: Array
    moments: Array
    inertia: Array
    wrench: Array
    twist: Array
    rows: Array
    gradient: Array
    extra: Array
    damped: Array
    step: Array
    moved: Array
    beyond: Array
    start: Array
    q: Array
    trial: Array
    kept: Array
    solved: Array
    residuals: Array
    N: Array
    V: Array
    worst: Array  # figures of the gate, of the thorax and each limb
    intermarker: Array
    passed: Array  # 1 for limbs that pass it
    weak_pull: Array  # (n,) of how uncertain a signal is: weights of the pull
    unseen_turn: Array  # (n,) what joints may have turned, rad
    turns: Array  # (2, nq) sine and cosine of each entry of q


def pack(problem: MarkerProblem) -> tuple[Indices, Array]:
    """Pack a problem into integers and reals, in the order of `unpack`."""
    p, tree = problem, problem.tree
    J, n, M = len(tree.kind), len(p.free), len(p.marker_joint)
    S, nq = p.starts.shape
    K = len(p.turn_joint)
    sizes = [J, n, M, S, nq, p.n_branches, p.max_iterations, K]
    whole = [
        tree.kind,
        tree.parent,
        tree.first_q,
        tree.first_v,
        p.angle,
        p.marker_joint,
        p.marker_carrier,
        p.marker_turn,
        p.marker_branch,
        p.q_branch,
        p.turn_joint,
    ]
    settings = [p.pull, p.pull_from_scratch, p.limit, p.tolerance, p.lost]
    real = [
        np.array(settings),
        tree.rotation,
        tree.translation,
        p.marker_position,
        p.marker_weight,
        p.free,
        p.lower,
        p.upper,
        p.starts,
    ]
    integers = np.concatenate([np.ravel(part) for part in whole]).astype(np.int64)
    reals = np.concatenate([np.ravel(part) for part in real]).astype(np.float64)
    header = [*sizes, HEADER + len(integers), len(reals)]
    return np.concatenate([np.array(header, dtype=np.int64), integers]), reals


@inner_borrowing
def unpack(whole: Indices, real: Array) -> MarkerProblem:
    """Unpack a problem, for a kernel that borrows its arrays, too.

    Counting references to the parts took as long as solving a tenth of a frame.
    """
    J, n, M, S, nq = whole[0], whole[1], whole[2], whole[3], whole[4]
    i, K = HEADER, whole[7]
    tree_at, i = i, i + 4 * J
    angle_at, i = i, i + n
    marker_at, i = i, i + 4 * M
    branch_at, i = i, i + nq
    turn_at = i
    r = 5
    rotation_at, r = r, r + 9 * J
    translation_at, r = r, r + 3 * J
    position_at, r = r, r + 3 * M
    weight_at, r = r, r + M
    dof_at, r = r, r + 3 * n
    starts_at = r
    tree = Tree(
        whole[tree_at : tree_at + J],
        whole[tree_at + J : tree_at + 2 * J],
        whole[tree_at + 2 * J : tree_at + 3 * J],
        whole[tree_at + 3 * J : tree_at + 4 * J],
        real[rotation_at : rotation_at + 9 * J].reshape(J, 3, 3),
        real[translation_at : translation_at + J * 3].reshape(J, 3),
    )
    return MarkerProblem(
        tree,
        whole[marker_at : marker_at + M],
        whole[marker_at + M : marker_at + 2 * M],
        whole[marker_at + 2 * M : marker_at + 3 * M],
        whole[turn_at : turn_at + K],
        real[position_at : position_at + M * 3].reshape(M, 3),
        real[weight_at : weight_at + M],
        real[dof_at : dof_at + n],
        whole[angle_at : angle_at + n],
        real[dof_at + n : dof_at + 2 * n],
        real[dof_at + 2 * n : dof_at + 3 * n],
        real[starts_at : starts_at + S * nq].reshape(S, nq),
        whole[marker_at + 3 * M : marker_at + 4 * M],
        whole[branch_at : branch_at + nq],
        whole[5],
        whole[6],
        real[0],
        real[1],
        real[2],
        real[3],
        real[4],
    )


def scratch_size(problem: MarkerProblem) -> int:
    """Return how many reals a frame's scratch memory has, in the order of `cut`."""
    J, n, M = len(problem.tree.kind), len(problem.free), len(problem.marker_joint)
    S, nq = problem.starts.shape
    groups = 1 + problem.n_branches
    of_joint = 9 + 3 + 12 + MOMENTS + INERTIA
    return (3 + 32 + J * of_joint + n * (6 + ROW + 8)) + (
        19 * M + nq * (6 + S) + groups * (3 + S)
    )


@inner_borrowing
def cut(problem: MarkerProblem, work: Array) -> Scratch:
    """Divide memory of :func:`scratch_size` reals into arrays; as :func:`unpack`.

    Tables of the same width are rows of one: to reshape takes 50 ns.
    """
    J, n, M = len(problem.tree.kind), len(problem.free), len(problem.marker_joint)
    S, nq = problem.starts.shape
    groups = 1 + problem.n_branches
    rotation_at = 3
    three_at = rotation_at + 9 * J
    six_at = three_at + 3 * (J + 6 * M)
    moments_at = six_at + 6 * (n + 2 * J)
    inertia_at = moments_at + MOMENTS * J
    rows_at = inertia_at + INERTIA * J
    q_at = rows_at + ROW * n
    residuals_at = q_at + nq * (6 + S)
    four_at = residuals_at + S * groups
    weight_at = four_at + 32
    rate_at = weight_at + M
    group_at = rate_at + 8 * n
    three = work[three_at:six_at].reshape(J + 6 * M, 3)
    six = work[six_at:moments_at].reshape(n + 2 * J, 6)
    of_q = work[q_at:residuals_at].reshape(6 + S, nq)
    four = work[four_at:weight_at].reshape(8, 4)
    return Scratch(
        work[0:3],
        work[rotation_at:three_at].reshape(J, 3, 3),
        three[:J],
        six[:n],
        work[weight_at:rate_at],
        three[J : J + M],
        three[J + M : J + 2 * M],
        three[J + 2 * M : J + 3 * M],
        three[J + 3 * M : J + 4 * M],
        three[J + 4 * M : J + 5 * M],
        three[J + 5 * M :],
        work[moments_at:inertia_at].reshape(J, MOMENTS),
        work[inertia_at:rows_at].reshape(J, INERTIA),
        six[n : n + J],
        six[n + J :],
        work[rows_at:q_at].reshape(n, ROW),
        work[rate_at : rate_at + n],
        work[rate_at + n : rate_at + 2 * n],
        work[rate_at + 2 * n : rate_at + 3 * n],
        work[rate_at + 3 * n : rate_at + 4 * n],
        work[rate_at + 4 * n : rate_at + 5 * n],
        work[rate_at + 5 * n : rate_at + 6 * n],
        of_q[0],
        of_q[1],
        of_q[2],
        of_q[3],
        of_q[6:],
        work[residuals_at:four_at].reshape(S, groups),
        four[:4],
        four[4:],
        work[group_at : group_at + groups],
        work[group_at + groups : group_at + 2 * groups],
        work[group_at + 2 * groups : group_at + 3 * groups - 1],
        work[rate_at + 6 * n : rate_at + 7 * n],
        work[rate_at + 7 * n : group_at],
        of_q[4:6],
    )
