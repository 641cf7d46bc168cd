"""Levenberg-Marquardt descent of one frame of marker inverse kinematics.

See :mod:`ikns._kernels.body.marker_ik` for the cost. The true Hessian is used where it
is positive definite, else that of Gauss-Newton.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.articulated import (
    diagonal,
    factor,
    slope,
    solve,
    write_inertia,
)
from ikns._kernels.body.free_turn import release_clusters
from ikns._kernels.body.marker_errors import add_penalties, marker_errors, penalties
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch
from ikns._kernels.body.step import integrate
from ikns._kernels.body.tree import joint_axes
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array

#: The step after one with the true Hessian is about its square times the rate at which
#: the Hessian changes, up to 50 per radian where markers barely determine a joint. So
#: after a step of this times the root of the tolerance less than 5 % of it remain.
_NEWTON = 0.03
#: Damping after a first step that was too long; from 1e-6 on several more were.
_FIRST = 1e-4
#: Damping from which on no equation is solvable: numbers are too large to square.
_HOPELESS = 1e30


@inner_borrowing
def copy(source: Array, into: Array) -> None:
    """Copy an array (n,) into another."""
    for i in range(len(into)):
        into[i] = source[i]


@inner_borrowing
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
        s.turns,
        s.rotation,
        s.translation,
        s.x,
        s.error,
        s.turned,
    )


@inner_borrowing
def penalties_at(problem: MarkerProblem, s: Scratch, q: Array, pull: float) -> float:
    """Write how far `q` is from `s.start` and beyond limits; return what that costs."""
    return penalties(
        problem.tree,
        problem.angle,
        problem.lower,
        problem.upper,
        s.start,
        pull,
        problem.limit,
        q,
        s.moved,
        s.beyond,
    )


@inner_borrowing
def descend(
    problem: MarkerProblem, n_seen: int, pull: float, s: Scratch
) -> tuple[float, int, bool]:
    """Levenberg-Marquardt from `s.q`, pulled to `s.start`; the result is in `s.q`.

    Errors in `s` are those of the result.
    """
    tree, carrier, tolerance = problem.tree, problem.marker_carrier, problem.tolerance
    enough = max(tolerance, _NEWTON * np.sqrt(tolerance))
    cost = distance = np.inf
    damping, iterations = 0.0, -1
    definite, true_hessian, converged, rejected = True, True, False, False
    copy(s.q, s.trial)
    while True:
        # Written out, as passing `problem` and `s` on would take 5 % longer.
        trial_cost, trial_distance = marker_errors(
            tree,
            problem.marker_joint,
            problem.marker_turn,
            problem.turn_joint,
            problem.marker_position,
            s.weight,
            s.target,
            s.trial,
            s.origin,
            s.turns,
            s.rotation,
            s.translation,
            s.x,
            s.error,
            s.turned,
        )
        trial_cost += penalties_at(problem, s, s.trial, pull)
        iterations += 1
        last = converged or iterations >= problem.max_iterations
        # A cost of NaN is no better either.
        rejected = not trial_cost <= cost
        if rejected and (last or iterations == 0):
            break
        if rejected:
            _copy_rows(s.best_x, s.x)
            _copy_rows(s.best_error, s.error)
            if true_hessian:
                true_hessian = False
            else:
                damping = max(10 * damping, _FIRST)
        else:
            cost, distance = trial_cost, trial_distance
            copy(s.trial, s.q)
            if last:
                break
            damping = damping / 10 if damping > 1e-6 else 0.0
            definite = true_hessian = True
            _copy_rows(s.x, s.best_x)
            _copy_rows(s.error, s.best_error)
            joint_axes(tree, s.rotation, s.translation, s.axes)
            slope(tree, carrier, s.axes, s.weight, s.x, s.error, s.wrench, s.gradient)
            add_penalties(
                problem.free,
                pull,
                problem.limit,
                s.moved,
                s.beyond,
                s.gradient,
                s.extra,
            )
        solvable = False
        while not solvable and damping < _HOPELESS:
            solvable = _factored(problem, s, damping, 1.0 if true_hessian else 0.0)
            if not solvable and true_hessian:
                definite = true_hessian = False
            elif not solvable:
                damping = max(10 * damping, _FIRST)
        if not solvable:
            converged = False
            break
        for d in range(len(s.step)):
            s.step[d] = -s.gradient[d]
        solve(tree, s.rows, s.twist, s.step)
        largest = _largest(s.step)
        integrate(tree, s.q, s.step, s.trial)
        # Without the true Hessian a small step proves less, unless there is no other.
        small = largest < (enough if true_hessian else tolerance)
        converged = small and (true_hessian or not definite or damping > 1e-3)
    if rejected:
        errors_at(problem, s, s.q)
    return np.sqrt(distance / n_seen), iterations, converged


@borrowing
def _copy_rows(source: Array, into: Array) -> None:
    for m in range(len(into)):
        for k in range(3):
            into[m, k] = source[m, k]


@borrowing
def _factored(problem: MarkerProblem, s: Scratch, damping: float, share: float) -> bool:
    """Factor the damped matrix into `s.rows`; False if it is not positive definite."""
    copy(s.extra, s.damped)
    if damping > 0:
        # In proportion to the diagonal (More), so that meters and radians are treated
        # alike.
        write_inertia(
            problem.marker_carrier,
            s.weight,
            s.x,
            s.error,
            0.0,
            s.moments,
            s.inertia,
        )
        diagonal(problem.tree, s.axes, s.moments, s.damped)
        for d in range(len(s.damped)):
            s.damped[d] = s.extra[d] + damping * (s.extra[d] + s.damped[d])
    return factor_at(problem, s, s.damped, share)


@inner_borrowing
def factor_at(problem: MarkerProblem, s: Scratch, extra: Array, share: float) -> bool:
    """Factor the matrix where errors and axes were taken last into `s.rows`.

    `extra` (n,) is added to the diagonal; see
    :mod:`ikns._kernels.body.articulated`, also for `share`. False if it is not positive
    definite.
    """
    write_inertia(
        problem.marker_carrier,
        s.weight,
        s.x,
        s.error,
        share,
        s.moments,
        s.inertia,
    )
    release_clusters(
        problem.tree,
        s.axes,
        problem.turn_joint,
        problem.marker_turn,
        s.weight,
        s.x,
        s.error,
        share,
        s.inertia,
    )
    return factor(
        problem.tree,
        s.axes,
        s.wrench,
        share,
        problem.free,
        extra,
        s.inertia,
        s.rows,
    )


@borrowing
def _largest(step: Array) -> float:
    """Limit a step to one radian or meter, beyond which the model is not valid."""
    largest = 0.0
    for d in range(len(step)):
        largest = max(largest, abs(step[d]))
    if largest > 1:
        for d in range(len(step)):
            step[d] /= largest
    return largest
