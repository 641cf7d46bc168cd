"""scipy's least_squares (MINPACK's Levenberg-Marquardt) over Pinocchio's kinematics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import scipy
from scipy.optimize import least_squares

from peers.problem import ACCURACY, Problem
from peers.timing import FrameByFrame


class LeastSquares(FrameByFrame):
    """The unknown is the tangent step from the pose before.

    Parameters
    ----------
    problem : Problem
    analytic : bool
        Give the Jacobian, else scipy takes finite differences.
    """

    version = scipy.__version__

    def __init__(self, problem: Problem, *, analytic: bool) -> None:
        self.skeleton, self.analytic = problem.skeleton, analytic
        self.model = pin.buildModelFromXML(
            problem.skeleton.urdf, pin.JointModelFreeFlyer()
        )
        super().__init__(self._solve, problem.markers, problem.start)

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        return self.skeleton.markers_in_world(q)

    def _solve(self, seen, before):
        skeleton, model = self.skeleton, self.model
        rows = np.isfinite(seen[:, 0])
        target = seen[rows]

        def residual(step):
            at = pin.integrate(model, before, step)
            return (skeleton.markers_in_world(at)[rows] - target).ravel()

        def jacobian(step):
            _, J = skeleton.marker_jacobian(pin.integrate(model, before, step))
            by_step = pin.dIntegrate(model, before, step)[1]
            return J[rows].reshape(-1, model.nv) @ by_step

        found = least_squares(
            residual,
            np.zeros(model.nv),
            jac=jacobian if self.analytic else "2-point",
            method="lm",
            xtol=ACCURACY,
            ftol=ACCURACY,
            gtol=ACCURACY,
        )
        return pin.integrate(model, before, found.x)
