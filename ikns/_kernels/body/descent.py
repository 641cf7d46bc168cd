"""Levenberg-Marquardt descent of one frame of marker inverse kinematics.

See :mod:`ikns._kernels.body.marker_ik` for the cost. The true Hessian is used where it
is positive definite, else that of Gauss-Newton.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.free_turn import release_clusters
from ikns._kernels.body.marker_errors import add_penalties, marker_errors, penalties
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch
from ikns._kernels.body.normal_equations import linearize
from ikns._kernels.body.step import integrate
from ikns._kernels.body.tree import joint_axes
from ikns._kernels.body.tree_cholesky import factor, solve
from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array, Indices

#: The step after one with the true Hessian is about its square times the rate at which
#: the Hessian changes, up to 50 per radian where markers barely determine a joint. So
#: after a step of this times the root of the tolerance less than 5 % of it remain.
_NEWTON = 0.03


@inner
def copy(source: Array, into: Array) -> None:
    """Copy an array (n,) into another."""
    for i in range(len(into)):
        into[i] = source[i]


@inner
def errors_at(problem: MarkerProblem, s: Scratch, q: Array) -> tuple[float, float]:
    """Write joints, markers and errors at `q` into `s`; return their squared sums.

    The sums are weighted and not.
    """
    return marker_errors(
        problem.tree,
        problem.marker_joint,
        problem.marker_turn,
        problem.turn_joint,
        problem.marker_position,
        s.weight,
        s.target,
        q,
        s.origin,
        s.rotation,
        s.translation,
        s.x,
        s.error,
        s.turned,
    )


@inner
def descend(
    problem: MarkerProblem, n_seen: int, pull: float, s: Scratch
) -> tuple[float, int, bool]:
    """Levenberg-Marquardt from `s.q`, pulled to `s.start`; the result is in `s.q`."""
    tolerance = problem.tolerance
    enough = max(tolerance, _NEWTON * np.sqrt(tolerance))
    cost = distance = np.inf
    damping, iterations = 1e-8, -1
    definite = true_hessian = converged = False
    copy(s.q, s.trial)
    while True:
        # Written out, as passing `problem` and `s` on would take 5 % longer.
        trial_cost, trial_distance = marker_errors(
            problem.tree,
            problem.marker_joint,
            problem.marker_turn,
            problem.turn_joint,
            problem.marker_position,
            s.weight,
            s.target,
            s.trial,
            s.origin,
            s.rotation,
            s.translation,
            s.x,
            s.error,
            s.turned,
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
            copy(s.trial, s.q)
            if iterations > 0:
                damping = max(damping / 10, 1e-12)
            if not converged and iterations < problem.max_iterations:
                linearize_at(problem, s, pull)
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
        # Without the true Hessian a small step proves less, unless there is no other.
        converged = largest < (enough if true_hessian else tolerance)
        if definite and not true_hessian:
            converged = converged and damping > 1e-3


@inner
def linearize_at(problem: MarkerProblem, s: Scratch, pull: float) -> None:
    """Write gradient, Hessian and curvature where the errors were taken last.

    Axes of joints are written too; penalties are those of ``s.moved`` and ``s.beyond``.
    """
    joint_axes(problem.tree, s.rotation, s.translation, s.axes)
    linearize(
        problem.tree,
        problem.path,
        problem.depth,
        s.axes,
        problem.marker_carrier,
        s.weight,
        s.x,
        s.error,
        s.moments,
        s.forces,
        s.gradient,
        s.hessian,
        s.curvature,
    )
    release_clusters(
        problem.tree,
        problem.path,
        problem.depth,
        s.axes,
        problem.turn_joint,
        problem.marker_turn,
        s.weight,
        s.x,
        s.error,
        s.forces,
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


@compiled
def _step(
    path: Indices,
    depth: Indices,
    gradient: Array,
    hessian: Array,
    curvature: Array,
    share: float,
    damping: float,
    factored: Array,
    step: Array,
) -> bool:
    """Write the damped step; False where its matrix is not positive definite.

    `share` of the curvature is used: 1 for the true Hessian, 0 for Gauss-Newton's.
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
def _largest(step: Array) -> float:
    """Limit a step to one radian or meter, beyond which the model is not valid."""
    largest = 0.0
    for d in range(len(step)):
        largest = max(largest, abs(step[d]))
    if largest > 1:
        for d in range(len(step)):
            step[d] /= largest
    return largest
