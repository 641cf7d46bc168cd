"""Marker inverse kinematics of one frame, and of a recording frame by frame.

Minimizes over the configuration q

    sum_m weight_m |x_m(q) - seen_m|^2 + (pull |q - before|)^2 + (limit |beyond|)^2

by Levenberg-Marquardt (More 1978), with the true Hessian where that is positive
definite: the curvature term is cheap here (see
:mod:`ikns._kernels.body.normal_equations`), and where markers deviate from the body by
centimeters Gauss-Newton needs many times as many steps.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.descent import copy, descend, errors_at
from ikns._kernels.body.marker_errors import take_markers
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch, cut, unpack
from ikns._kernels.body.rigid import rigid_pose
from ikns._kernels.body.tree import FREE_FLYER
from ikns._kernels.compiled import compiled
from ikns.arrays import Array, Indices, Mask

#: Iterations of a frame with an infinite marker, which is a fault and not a gap.
INFINITE = -1


@compiled
def solve_frames(
    whole: Indices,
    real: Array,
    markers: Array,
    first: int,
    last: int,
    way: int,
    before: Array,
    from_scratch: bool,
    work: Array,
    q: Array,
    residual: Array,
    iterations: Indices,
    converged: Mask,
) -> None:
    """Solve frames from `first` to before `last`, `way` (1 or -1) one after the other.

    `whole` and `real` are a packed
    :class:`ikns._kernels.body.marker_problem.MarkerProblem`, `markers` (T, M, 3) in the
    world, m, NaN where not seen; `before` (nq,) is the pose before the first frame,
    unless it is solved `from_scratch`, and later frames start from the previous one.
    `work` is scratch of :func:`ikns._kernels.body.marker_problem.scratch_size` reals.

    Written are the solutions `q` (T, nq), the previous pose where no marker is seen,
    and by frame (T,) the `residual`, the root mean square distance of the seen markers
    (m; NaN without any, infinite where the previous pose is not finite), whether it
    `converged`, and `iterations`: `INFINITE` where a marker is infinite, not seen and
    not NaN.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    for i in range(first, last, way):
        start = before if i == first else q[i - way]
        residual[i], iterations[i], converged[i] = solve_frame(
            problem, s, markers[i], start, from_scratch and i == first, q[i]
        )


@compiled
def _finite(q: Array) -> bool:
    total = 0.0
    for i in range(len(q)):
        total += q[i] - q[i]
    return total == 0


@compiled
def solve_frame(
    problem: MarkerProblem,
    s: Scratch,
    seen: Array,
    before: Array,
    from_scratch: bool,
    q: Array,
) -> tuple[float, int, bool]:
    """Write the solution of one frame, (nq,); return residual, iterations, converged.

    Round -1 descends from the previous pose. Without one, or where that fails, rounds
    0, 1, ... descend from the starts, the last from the best result for each limb.
    """
    n_seen, infinite = take_markers(problem.marker_weight, seen, s.weight, s.target)
    copy(before, s.start)
    copy(before, q)
    best_residual, best_iterations, best_converged = np.inf, 0, False
    if not _finite(before):
        return best_residual, best_iterations, best_converged
    if n_seen == 0:
        return np.nan, INFINITE if infinite else 0, best_converged
    n_starts = len(problem.starts)
    for k in range(0 if from_scratch else -1, n_starts + 1):
        pull = problem.pull if k < 0 else problem.pull_from_scratch
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
        if residual < best_residual:
            best_residual = residual
            best_iterations, best_converged = iterations, converged
            copy(s.q, q)
        if k < 0 and residual <= problem.lost:
            break
        if 0 <= k < n_starts:
            copy(s.q, s.solved[k])
            errors_at(problem, s, s.q)
            s.residuals[k, 0] = residual
            _sum_by_limb(problem.marker_branch, s.weight, s.error, s.residuals[k])
    return best_residual, INFINITE if infinite else best_iterations, best_converged


@compiled
def _sum_by_limb(
    branch: Indices, weight: Array, error: Array, residuals: Array
) -> None:
    """Write each limb's squared errors after the first entry."""
    for b in range(1, len(residuals)):
        residuals[b] = 0.0
    for m in range(len(weight)):
        if weight[m] > 0 and branch[m] >= 0:
            for a in range(3):
                residuals[1 + branch[m]] += error[m, a] ** 2


@compiled
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
