"""Marker inverse kinematics of one frame.

Minimizes over the configuration q

    sum_m weight_m |x_m(q) - seen_m|^2 + (pull |q - before|)^2 + (limit |beyond|)^2

by Levenberg-Marquardt (More 1978), with the true Hessian where that is positive
definite: the curvature term is cheap here (see :mod:`ikns._kernels.body.articulated`),
and where markers deviate from the body by centimeters Gauss-Newton needs many times as
many steps.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.descent import copy, descend, errors_at
from ikns._kernels.body.marker_errors import take_markers
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch
from ikns._kernels.body.rigid import rigid_pose
from ikns._kernels.body.tree import FREE_FLYER
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array, Indices

#: Iterations of a frame with an infinite marker, which is a fault and not a gap.
INFINITE = -1
#: Joints this far beyond their limits, rad (root of the sum of squares), make a pose
#: doubtful: people's marker errors take them a few degrees beyond.
FAR = 0.26


@borrowing
def _finite(q: Array) -> bool:
    total = 0.0
    for i in range(len(q)):
        total += q[i] - q[i]
    return total == 0


@inner_borrowing
def solve_frame(
    problem: MarkerProblem,
    s: Scratch,
    seen: Array,
    before: Array,
    from_scratch: bool,
    loose: bool,
    q: Array,
) -> tuple[float, int, bool]:
    """Write the solution of one frame, (nq,); return residual, iterations, converged.

    Errors in `s` are those of the solution, if any marker is seen.
    `loose` pulls less to the previous pose, which may be some time ago.

    Round -1 descends from the previous pose. Without one, or where that fails, rounds
    0, 1, ... descend from the starts, the last from the best result for each limb.
    """
    n_seen, infinite = take_markers(problem.marker_weight, seen, s.weight, s.target)
    copy(before, s.start)
    copy(before, q)
    best_residual, best_iterations, best_converged = np.inf, 0, False
    best_cost = np.inf
    if not _finite(before):
        errors_at(problem, s, q)
        return best_residual, best_iterations, best_converged
    if n_seen == 0:
        return np.nan, INFINITE if infinite else 0, best_converged
    n_starts = len(problem.starts)
    for k in range(0 if from_scratch else -1, n_starts + 1):
        pull = problem.pull_from_scratch if k >= 0 or loose else problem.pull
        aligned = problem.tree.kind[0] == FREE_FLYER and n_seen >= 3
        if 0 <= k < n_starts:
            copy(problem.starts[k], s.start)
        elif k == n_starts:
            _join_limbs(problem.q_branch, s.solved, s.residuals, s.start)
        if 0 <= k < n_starts and aligned:
            # Starts have their root at the origin; align them with the markers.
            errors_at(problem, s, s.start)
            rigid_pose(s.x, s.target, s.weight, s.N, s.V, s.start)
        copy(s.start, s.q)
        residual, iterations, converged = descend(problem, n_seen, pull, s)
        # Half turns about all axes of a shoulder leave the markers where they are, so
        # only its limits tell such poses apart.
        cost = residual**2 * n_seen + _beyond(problem, s.q, -1)
        if cost < best_cost:
            best_cost, best_residual = cost, residual
            best_iterations, best_converged = iterations, converged
            copy(s.q, q)
        if k < 0 and residual <= problem.lost:
            return residual, INFINITE if infinite else iterations, converged
        if 0 <= k < n_starts:
            copy(s.q, s.solved[k])
            errors_at(problem, s, s.q)
            s.residuals[k, 0] = cost
            _sum_by_limb(problem, s, s.q, s.residuals[k])
    errors_at(problem, s, q)
    return best_residual, INFINITE if infinite else best_iterations, best_converged


@inner_borrowing
def far_cost(problem: MarkerProblem, q: Array) -> float:
    """Return the cost of joints beyond their limits, m^2; 0 unless they are far."""
    cost = _beyond(problem, q, -1)
    return cost if cost > (problem.limit * FAR) ** 2 else 0.0


@borrowing
def _beyond(problem: MarkerProblem, q: Array, branch: int) -> float:
    """Return the cost of limits for one limb, or for all with -1, however small."""
    square = 0.0
    for i in range(len(problem.angle)):
        at = problem.angle[i]
        if at >= 0 and (branch < 0 or problem.q_branch[at] == branch):
            over = max(q[at] - problem.upper[i], 0.0)
            over += min(q[at] - problem.lower[i], 0.0)
            square += over**2
    return problem.limit**2 * square


@borrowing
def _sum_by_limb(
    problem: MarkerProblem, s: Scratch, q: Array, residuals: Array
) -> None:
    """Write each limb's squared errors and cost of limits after the first entry."""
    for b in range(1, len(residuals)):
        residuals[b] = _beyond(problem, q, b - 1)
    for m in range(len(s.weight)):
        branch = problem.marker_branch[m]
        if s.weight[m] > 0 and branch >= 0:
            for a in range(3):
                residuals[1 + branch] += s.error[m, a] ** 2


@borrowing
def _join_limbs(branch: Indices, solved: Array, residuals: Array, start: Array) -> None:
    """Write the best solution, with each limb from the solution that fits it best."""
    best = 0
    for k in range(len(solved)):
        if residuals[k, 0] < residuals[best, 0]:
            best = k
    for i in range(len(start)):
        own = best
        if branch[i] >= 0:
            for k in range(len(solved)):
                if residuals[k, 1 + branch[i]] < residuals[own, 1 + branch[i]]:
                    own = k
        start[i] = solved[own, i]
