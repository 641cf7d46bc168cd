"""The sparse least-squares problem of the length fit, for IPOPT.

The unknowns are the postures x_k of all frames and, shared, the log sizes s and the
marker offsets o. Only frame k depends on x_k, so the Hessian is an arrowhead matrix:
one block per frame, and a border for the shared unknowns. It is assembled from the
exact blocks of one frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ikns.arrays import Array
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.size_fit import size_covariance
from ikns.symbolic.kinematics import sized_markers

_IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    # Of the gradient, once IPOPT has scaled it; the cost is in squared deviations.
    "tol": 1e-6,
    "max_iter": 100,
}


@dataclass(frozen=True, eq=False)
class FrameData:
    """Seen markers, and the posture to start from in each frame.

    Markers (F, M, 3) are in the world, m, anything where the weight is zero; `weights`
    (F, M) are inverse variances per axis, 1/m^2; `pulls` (F,) inverse variances of the
    joint angles about zero, 1/rad^2: a weak prior for what no marker shows.
    """

    q: Array
    markers: Array
    weights: Array
    pulls: Array


@dataclass(frozen=True, eq=False)
class Solution:
    """The minimum.

    `covariance` (S, S) is that of the log sizes: inverse curvature of half the cost;
    `squares` (F, M) are squared distances of markers from where they were seen, m^2.
    """

    log_sizes: Array
    covariance: Array
    offsets: Array
    q: Array
    squares: Array
    solved: bool
    status: str
    iterations: int


class LengthProgram:
    """The fit of sizes, offsets and postures to a number of frames.

    `reference` is the generic body, markers at their nominal places.
    """

    def __init__(self, reference: Skeleton, n_frames: int) -> None:
        m, n = len(reference.marker_set.markers), reference.nv
        self._n, self._m, self._frames = n, m, n_frames
        held = reference.columns(reference.marker_set.held)
        self._free = np.isin(np.arange(n), held, invert=True)
        x, start = ca.SX.sym("x", n), ca.SX.sym("start", 4)
        sizes, offsets = ca.SX.sym("s", len(SEGMENTS)), ca.SX.sym("o", m, 3)
        seen, weights = ca.SX.sym("seen", m, 3), ca.SX.sym("w", m)
        pull = ca.SX.sym("pull")
        shared = ca.vertcat(sizes, ca.vec(offsets))
        q = ca.vertcat(x[:3], _turned(start, x[3:6]), x[6:])
        squares = ca.sum2((sized_markers(reference, q, sizes, offsets) - seen) ** 2)
        cost = (ca.dot(weights, squares) + pull * ca.sumsqr(x[6:])) / 2
        inputs = [x, shared, start, seen, weights, pull]
        H = ca.hessian(cost, ca.vertcat(x, shared))[0]
        one = {
            "cost": [cost],
            "parts": [q, squares],
            "blocks": [H[:n, :n], H[:n, n:], H[n:, n:]],
        }
        of_frame = {k: ca.Function(k, inputs, v) for k, v in one.items()}
        self._parts = of_frame["parts"].map(n_frames)

        X, Y = ca.MX.sym("X", n, n_frames), ca.MX.sym("Y", shared.size1())
        given = [
            ca.MX.sym("start", 4, n_frames),
            ca.MX.sym("seen", m, 3 * n_frames),
            ca.MX.sym("w", m, n_frames),
            ca.MX.sym("pull", 1, n_frames),
        ]
        spread = np.array(
            [marker.placement_sd for marker in reference.marker_set.markers]
        )
        belief = np.zeros((shared.size1(), shared.size1()))
        k = len(SEGMENTS)
        belief[:k, :k] = np.linalg.inv(size_covariance())
        belief[k:, k:] = np.diag(spread.ravel(order="F") ** -2.0)
        prior = ca.DM(csc_matrix(belief))
        total = of_frame["cost"].map("costs", "serial", n_frames, [1], [0])(
            X, Y, *given
        )
        A, B, C = of_frame["blocks"].map("all", "serial", n_frames, [1], [2])(
            X, Y, *given
        )
        blocks = ca.diagcat(*ca.horzsplit(A, n))
        border = ca.vertcat(*ca.horzsplit(B, shared.size1()))
        z = ca.vertcat(ca.vec(X), Y)
        p = ca.vertcat(*(ca.vec(g) for g in given))
        whole = ca.blockcat([[blocks, border], [border.T, C + prior]])
        self._hessian = ca.Function("hessian", [z, p], [whole])
        # The symbols that nlpsol expects for a Hessian.
        at, by, factor, none = (
            ca.MX.sym(name, size)
            for name, size in (("x", z.size1()), ("p", p.size1()), ("f", 1), ("g", 0))
        )
        curvature = ca.Function(
            "curvature",
            [at, by, factor, none],
            [ca.triu(factor * self._hessian(at, by))],
            ["x", "p", "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        )
        problem: dict[str, Any] = {
            "x": z,
            "p": p,
            "f": total + ca.bilin(prior, Y, Y) / 2,
        }
        options: dict[str, Any] = {
            "print_time": False,
            "ipopt": _IPOPT,
            "hess_lag": curvature,
        }
        self._solver = ca.nlpsol("lengths", "ipopt", problem, options)

    def solve(self, frames: FrameData, log_sizes: Array, offsets: Array) -> Solution:
        """Minimize from these sizes (S,), offsets (M, 3) m and postures."""
        n, f = self._n, self._frames
        x = np.hstack([frames.q[:, :3], np.zeros((f, 3)), frames.q[:, 7:]])
        shared = np.concatenate([log_sizes, offsets.ravel(order="F")])
        seen = np.where(frames.weights[..., None] > 0, frames.markers, 0.0)
        given = [
            frames.q[:, 3:7].T,
            np.hstack(list(seen)),
            frames.weights.T,
            frames.pulls[None],
        ]
        p = np.concatenate([g.ravel(order="F") for g in given])
        start = np.concatenate([x.ravel(), shared])
        fixed = np.concatenate([np.tile(~self._free, f), np.zeros(len(shared), bool)])
        result = self._solver(
            x0=start,
            p=p,
            lbx=np.where(fixed, start, -np.inf),
            ubx=np.where(fixed, start, np.inf),
        )
        stats = self._solver.stats()
        z = result["x"].full().ravel()
        X, Y = z[: n * f].reshape(f, n), z[n * f :]
        q, squares = self._parts(X.T, Y, *given)
        k = len(log_sizes)
        curvature = csc_matrix(self._hessian(z, p).sparse())[~fixed][:, ~fixed]
        first = int(np.sum(~fixed)) - len(shared)
        ends = np.zeros((curvature.shape[0], k))
        ends[first : first + k] = np.eye(k)
        covariance = splu(curvature.tocsc()).solve(ends)[first : first + k]
        return Solution(
            log_sizes=Y[:k],
            covariance=covariance,
            offsets=Y[k:].reshape(3, -1).T,
            q=q.full().T,
            squares=squares.full().T,
            solved=bool(stats["success"]),
            status=str(stats["return_status"]).replace("_", " ").lower(),
            iterations=int(stats["iter_count"]),
        )


def _turned(quaternion: ca.SX, by: ca.SX) -> ca.SX:
    """Quaternion (x, y, z, w) after a turn given by its Cayley vector, in its frame.

    The vector is the axis times the tangent of half the angle; zero turns nothing, and
    there is no singularity within half a turn.
    """
    turn = ca.vertcat(by, 1) / ca.sqrt(1 + ca.sumsqr(by))
    a, w1, b, w2 = quaternion[:3], quaternion[3], turn[:3], turn[3]
    return ca.vertcat(w1 * b + w2 * a + ca.cross(a, b), w1 * w2 - ca.dot(a, b))
