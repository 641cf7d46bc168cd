"""The two nonlinear programs of a held hand, for IPOPT.

Direct transcription of a self-motion as in Betts 2010, Practical Methods for Optimal
Control, and IPOPT of Waechter & Biegler 2006, Math Program 106:25.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ikns.arrays import Array
from ikns.symbolic.chain import ChainModel, Held

#: IPOPT without its output, to 1e-9 in meters and radians; a warm start stays near.
IPOPT: dict[str, Any] = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-9,
        "constr_viol_tol": 1e-9,
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "mu_init": 1e-4,
        "bound_push": 1e-7,
        "bound_frac": 1e-7,
        "max_iter": 200,
    },
}
#: Postures of a sweep on either side of its start.
NODES = 8


class Climber:
    """Maximize ``Z @ x`` over the postures x that hold the hand."""

    def __init__(self, chain: ChainModel, held: Held) -> None:
        x, hold = _symbols(chain)
        Z = ca.SX.sym("Z", x.size1())
        self._chain = chain
        self._lower = np.zeros(held.off.size1_out(0) + len(held.names))
        self._upper = np.r_[
            np.zeros(held.off.size1_out(0)), np.full(len(held.names), np.inf)
        ]
        problem = {
            "x": x,
            "p": ca.vertcat(*(ca.vec(s) for s in hold), Z),
            "f": -ca.dot(Z, x),
            "g": ca.vertcat(held.off(x, *hold), held.clearance(x, hold[0])),
        }
        self._solver = ca.nlpsol("climber", "ipopt", problem, IPOPT)

    def solve(self, guess: Array, hold: Array, Z: Array) -> tuple[Array, bool, str]:
        """Return the posture (n,), whether it is a solution, and IPOPT's status."""
        result = self._solver(
            x0=guess,
            p=np.concatenate([hold, Z]),
            lbx=self._chain.lower,
            ubx=self._chain.upper,
            lbg=self._lower,
            ubg=self._upper,
        )
        return (result["x"].full().ravel(), *_outcome(self._solver))


class Sweeper:
    """Maximize the step of an even polygon of postures that hold the hand."""

    def __init__(self, chain: ChainModel, held: Held) -> None:
        start, hold = _symbols(chain)
        n = start.size1()
        ahead, step = ca.SX.sym("ahead", n), ca.SX.sym("h")
        nodes = ca.SX.sym("x", n, NODES)
        before, leg, g = start, ahead, []
        for k in range(NODES):
            x = nodes[:, k]
            onward = x - before
            g += [
                held.off(x, *hold),
                ca.sumsqr(onward) - step**2,
                ca.dot(onward, leg),
                held.clearance(x, hold[0]),
            ]
            before, leg = x, onward
        rows, rooms = held.off.size1_out(0), len(held.names)
        self._shape, self._chain = (NODES, n), chain
        self._lower = np.zeros(NODES * (rows + 2 + rooms))
        self._upper = np.tile(
            np.r_[np.zeros(rows + 1), np.full(1 + rooms, np.inf)], NODES
        )
        problem = {
            "x": ca.vertcat(ca.vec(nodes), step),
            "p": ca.vertcat(*(ca.vec(s) for s in hold), start, ahead),
            "f": -step,
            "g": ca.vertcat(*g),
        }
        self._solver = ca.nlpsol("sweeper", "ipopt", problem, IPOPT)

    def solve(self, guess: Array, hold: Array, ahead: Array) -> tuple[Array, bool, str]:
        """Return postures from the start (K + 1, n), whether solved, IPOPT's status.

        The guess (K + 1, n) has the start, then postures that hold the hand about
        evenly; `ahead` is the direction of the first step.
        """
        step = float(np.linalg.norm(guess[1] - guess[0]))
        result = self._solver(
            x0=np.append(guess[1:].ravel(), step),
            p=np.concatenate([hold, guess[0], ahead]),
            lbx=np.append(np.tile(self._chain.lower, NODES), 0.0),
            ubx=np.append(np.tile(self._chain.upper, NODES), np.inf),
            lbg=self._lower,
            ubg=self._upper,
        )
        nodes = result["x"].full()[:-1, 0].reshape(self._shape)
        return (np.vstack([guess[0], nodes]), *_outcome(self._solver))


def _symbols(chain: ChainModel) -> tuple[ca.SX, tuple[ca.SX, ca.SX, ca.SX]]:
    """Joints of the chain; angles of the body, hands' positions and rotations."""
    h = len(chain.ends)
    hold = (
        ca.SX.sym("angles", chain.n_angles),
        ca.SX.sym("p", 3, h),
        ca.SX.sym("R", 3, 3 * h),
    )
    return ca.SX.sym("x", len(chain.columns)), hold


def _outcome(solver: ca.Function) -> tuple[bool, str]:
    stats = solver.stats()
    return bool(stats["success"]), str(stats["return_status"]).replace("_", " ").lower()
