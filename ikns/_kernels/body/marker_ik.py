"""Marker inverse kinematics of one frame, and of a recording frame by frame.

Minimizes over the configuration q

    sum_m weight_m |x_m(q) - seen_m|^2 + (pull |q - before|)^2 + (limit |beyond|)^2

by Levenberg-Marquardt (More 1978) as :mod:`ikns.motion.marker_ik.reference` does, but
with the true Hessian where that is positive definite: the curvature term costs next to
nothing here (see :mod:`ikns._kernels.body.normal_equations`), and where markers
disagree with the body by centimeters Gauss-Newton takes many times as many steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.body.marker_errors import (
    add_penalties,
    marker_errors,
    penalties,
    take_markers,
)
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch, cut, unpack
from ikns._kernels.body.normal_equations import linearize
from ikns._kernels.body.rigid import rigid_pose
from ikns._kernels.body.step import integrate
from ikns._kernels.body.tree import FREE_FLYER, Floats, Indices, joint_axes
from ikns._kernels.body.tree_cholesky import factor, solve
from ikns._kernels.compiled import compiled

__all__ = ["INFINITE", "solve_frame", "solve_frames"]

#: Stands for the iterations of a frame with an infinite marker: a fault, not a gap.
INFINITE = -1

#: A step with the true Hessian is followed by one of about its square, times how fast
#: the Hessian changes: up to 50 per radian where markers barely show a joint. A step of
#: this times the root of the tolerance so leaves less than 5 % of the tolerance.
_NEWTON = 0.03


@compiled
def solve_frames(
    whole: Indices,
    real: Floats,
    markers: Floats,
    first: int,
    last: int,
    way: int,
    before: Floats,
    from_scratch: bool,
    work: Floats,
    q: Floats,
    residual: Floats,
    iterations: Indices,
    converged: NDArray[np.bool_],
) -> None:
    """Solve frames from `first` to before `last`, `way` (1 or -1) one after the other.

    Parameters
    ----------
    whole, real : arrays
        A packed :class:`ikns._kernels.body.marker_problem.MarkerProblem`.
    markers : (T, M, 3) array
        Markers in the world, m; NaN where not seen.
    first, last, way : int
    before : (nq,) array
        The pose before the first frame; later frames start from the one before.
    from_scratch : bool
        Whether there is none, so the first frame cannot start from `before`.
    work : array
        Memory of the size that the problem needs.
    q : (T, nq) array
        The solutions; the pose before where no marker is seen.
    residual : (T,) array
        Root mean square distance of the seen markers, m; NaN without any, infinite
        where the pose before is not finite.
    iterations, converged : (T,) arrays
        Iterations are `INFINITE` where a marker is infinite, not seen and not NaN.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    for i in range(first, last, way):
        start = before if i == first else q[i - way]
        residual[i], iterations[i], converged[i] = solve_frame(
            problem, s, markers[i], start, from_scratch and i == first, q[i]
        )


@compiled
def _finite(q: Floats) -> bool:
    total = 0.0
    for i in range(len(q)):
        total += q[i] - q[i]
    return total == 0


@compiled
def _copy(source: Floats, into: Floats) -> None:
    for i in range(len(into)):
        into[i] = source[i]


@compiled
def solve_frame(
    problem: MarkerProblem,
    s: Scratch,
    seen: Floats,
    before: Floats,
    from_scratch: bool,
    q: Floats,
) -> tuple[float, int, bool]:
    """Write the solution of one frame, (nq,); return residual, iterations, converged.

    Round -1 descends from the pose before. Without it, or lost, rounds 0, 1, ... do
    from several others, and the last goes on from what is best for each limb.
    """
    n_seen, infinite = take_markers(problem.marker_weight, seen, s.weight, s.target)
    _copy(before, s.start)
    _copy(before, q)
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
            _copy(problem.starts[k], s.start)
        elif k == n_starts:
            _join_limbs(problem.q_branch, s.solved, s.residuals, s.start)
        if 0 <= k < n_starts and aligned:
            # Starts have their root at the origin; lay them over the markers.
            marker_errors(
                problem.tree,
                problem.marker_joint,
                problem.marker_position,
                s.weight,
                s.target,
                s.start,
                s.origin,
                s.rotation,
                s.translation,
                s.x,
                s.error,
            )
            rigid_pose(s.x, s.target, s.weight, s.N, s.V, s.start)
        _copy(s.start, s.q)
        residual, iterations, converged = _descend(problem, n_seen, pull, s)
        if residual < best_residual:
            best_residual = residual
            best_iterations, best_converged = iterations, converged
            _copy(s.q, q)
        if k < 0 and residual <= problem.lost:
            break
        if 0 <= k < n_starts:
            _copy(s.q, s.solved[k])
            marker_errors(
                problem.tree,
                problem.marker_joint,
                problem.marker_position,
                s.weight,
                s.target,
                s.q,
                s.origin,
                s.rotation,
                s.translation,
                s.x,
                s.error,
            )
            s.residuals[k, 0] = residual
            _sum_by_limb(problem.marker_branch, s.weight, s.error, s.residuals[k])
    return best_residual, INFINITE if infinite else best_iterations, best_converged


@compiled
def _sum_by_limb(
    branch: Indices, weight: Floats, error: Floats, residuals: Floats
) -> None:
    """Write each limb's squared errors behind the first entry."""
    for b in range(1, len(residuals)):
        residuals[b] = 0.0
    for m in range(len(weight)):
        if weight[m] > 0 and branch[m] >= 0:
            for a in range(3):
                residuals[1 + branch[m]] += error[m, a] ** 2


@compiled
def _join_limbs(
    branch: Indices, solved: Floats, residuals: Floats, start: Floats
) -> None:
    """Write the best solution, each limb taken from where it is best."""
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


@compiled
def _step(
    path: Indices,
    depth: Indices,
    gradient: Floats,
    hessian: Floats,
    curvature: Floats,
    share: float,
    damping: float,
    factored: Floats,
    step: Floats,
) -> bool:
    """Write the damped step; False where its matrix is not positive definite.

    `share` of the curvature counts: 1 for the true Hessian, 0 for Gauss and Newton's.
    """
    for d in range(len(depth)):
        last = depth[d]
        for a in range(last + 1):
            factored[d, a] = hessian[d, a] + share * curvature[d, a]
        # Damping in proportion to the diagonal (More), so that meters and radians are
        # treated alike.
        factored[d, last] += damping * hessian[d, last] + 1e-14
        step[d] = -gradient[d]
    if not factor(factored, path, depth):
        return False
    solve(factored, path, depth, step)
    return True


@compiled
def _largest(step: Floats) -> float:
    """Cut a step to one radian or meter: beyond, the quadratic model knows nothing."""
    largest = 0.0
    for d in range(len(step)):
        largest = max(largest, abs(step[d]))
    if largest > 1:
        for d in range(len(step)):
            step[d] /= largest
    return largest


@compiled
def _descend(
    problem: MarkerProblem, n_seen: int, pull: float, s: Scratch
) -> tuple[float, int, bool]:
    """Levenberg-Marquardt from `s.q`, pulled to `s.start`; the result is in `s.q`."""
    tolerance = problem.tolerance
    enough = max(tolerance, _NEWTON * np.sqrt(tolerance))
    cost = distance = np.inf
    damping, iterations = 1e-8, -1
    definite = true_hessian = converged = False
    _copy(s.q, s.trial)
    while True:
        trial_cost, trial_distance = marker_errors(
            problem.tree,
            problem.marker_joint,
            problem.marker_position,
            s.weight,
            s.target,
            s.trial,
            s.origin,
            s.rotation,
            s.translation,
            s.x,
            s.error,
        )
        trial_cost += penalties(
            problem.tree,
            problem.angle,
            problem.lower,
            problem.upper,
            s.start,
            pull,
            problem.limit,
            s.trial,
            s.moved,
            s.beyond,
        )
        iterations += 1
        if trial_cost <= cost:
            cost, distance = trial_cost, trial_distance
            _copy(s.trial, s.q)
            if iterations > 0:
                damping = max(damping / 10, 1e-12)
            if not converged and iterations < problem.max_iterations:
                joint_axes(problem.tree, s.rotation, s.translation, s.axes)
                linearize(
                    problem.tree,
                    problem.path,
                    problem.depth,
                    s.axes,
                    problem.marker_joint,
                    s.weight,
                    s.x,
                    s.error,
                    s.moments,
                    s.forces,
                    s.gradient,
                    s.hessian,
                    s.curvature,
                )
                add_penalties(
                    problem.path,
                    problem.depth,
                    problem.free,
                    pull,
                    problem.limit,
                    s.moved,
                    s.beyond,
                    s.gradient,
                    s.hessian,
                    s.curvature,
                )
            definite = true_hessian = True
        elif true_hessian:
            true_hessian = False
        else:
            damping = max(10 * damping, 1e-6)
        if converged or iterations >= problem.max_iterations:
            return np.sqrt(distance / n_seen), iterations, converged
        solvable = False
        while not solvable:
            solvable = _step(
                problem.path,
                problem.depth,
                s.gradient,
                s.hessian,
                s.curvature,
                1.0 if true_hessian else 0.0,
                damping,
                s.factored,
                s.step,
            )
            if not solvable and true_hessian:
                definite = true_hessian = False
            elif not solvable:
                damping = max(10 * damping, 1e-6)
        largest = _largest(s.step)
        integrate(problem.tree, s.q, s.step, s.trial)
        # A small step without the true Hessian says less, unless there is no other.
        converged = largest < (enough if true_hessian else tolerance)
        if definite and not true_hessian:
            converged = converged and damping > 1e-3
