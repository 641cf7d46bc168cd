"""Arms of another making that hold a hand and turn the elbow: poses, swivel, walks.

The bodies are those of ``tests/other_body.py``: carrying angles of 0 to 20 deg, joint
axes that are not the model's and do not meet. Everything here is plain numpy; neither
`ikns.simulation` nor the package's kinematics has a part in it.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
import other_body
from other_body import Arm, turn

Array = np.ndarray
#: An easy posture from which searches start, rad.
EASY = np.radians([25, 35, 15, 80, 40, -5, 5])
#: Zero of the swivel: 10 deg below forward, 20 deg outward, and "down" normal to it.
AHEAD = np.array([0.925, -0.174, 0.337]) / np.linalg.norm([0.925, -0.174, 0.337])
BELOW = np.array([0.0, -1.0, 0.0]) - np.array([0.0, -1.0, 0.0]) @ AHEAD * AHEAD
BELOW /= np.linalg.norm(BELOW)
#: Step of a walk along the self-motion, rad of swivel.
_STEP = np.radians(2.0)


class Pose(NamedTuple):
    """Where an arm is, for postures (T, 7); thorax frame, m."""

    axes: Array  # (T, 7, 3), of the joints
    centers: Array  # (T, 7, 3), of the joints
    knuckle: Array  # (T, 3)
    hand: Array  # (T, 3, 3)

    @property
    def shoulder(self) -> Array:
        """Shoulder centers (T, 3)."""
        return self.centers[:, 0]

    @property
    def wrist(self) -> Array:
        """Wrist centers (T, 3)."""
        return self.centers[:, 5]

    @property
    def hand_axis(self) -> Array:
        """Long axis of the hand (T, 3)."""
        way = self.knuckle - self.wrist
        return way / np.linalg.norm(way, axis=1, keepdims=True)

    @property
    def swivel(self) -> Array:
        """Turn of the elbow's axis about the line from shoulder to wrist (T,), rad."""
        n = self.wrist - self.shoulder
        n = n / np.linalg.norm(n, axis=1, keepdims=True)
        z = self.axes[:, 3]
        elbow = np.cross(n, z)
        # The least rotation that takes AHEAD to n takes BELOW to u.
        k = np.cross(AHEAD, n)
        kb = np.cross(k, BELOW)
        u = BELOW + kb + np.cross(k, kb) / (1 + n @ AHEAD)[:, None]
        return np.arctan2(np.sum(elbow * np.cross(u, n), 1), np.sum(elbow * u, 1))

    @property
    def jacobian(self) -> Array:
        """Linear and angular velocity of the knuckle by each joint, (T, 6, 7)."""
        lever = self.knuckle[:, None] - self.centers
        rows = np.concatenate([np.cross(self.axes, lever), self.axes], axis=2)
        return np.swapaxes(rows, 1, 2)


def pose(arm: Arm, q: Array) -> Pose:
    """Place a right arm at postures (T, 7), rad."""
    R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    p = np.broadcast_to(arm.offsets[0], (len(q), 3))
    axes, centers = np.empty((len(q), 7, 3)), np.empty((len(q), 7, 3))
    for j in range(7):
        p = p + R @ arm.offsets[j] if j else p
        if j == 4:
            R = R @ turn(np.array([1.0, 0, 0]), -arm.carrying)
        axes[:, j], centers[:, j] = R @ arm.axes[j], p
        R = R @ turn(arm.axes[j], q[:, j])
    return Pose(axes, centers, p + R @ arm.offsets[7], R)


def wrapped(angle: Array) -> Array:
    """Angles in [-pi, pi), rad."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def posed(
    arm: Arm, wrist: Array, swivel: Array, distal: Array, near: Array | None = None
) -> Array:
    """Postures (T, 7) with wrists (T, 3) m, swivels (T,) and distal joints (T, 3).

    Damped Newton steps of shoulder and elbow, from an easy posture or from `near`
    (T, 7). Distal joints are pronation, wrist flexion and deviation, rad.
    """
    first = np.tile(EASY[:4], (len(wrist), 1)) if near is None else near[:, :4]
    q = np.hstack([first, distal])

    def miss(rows: Array) -> Array:
        at = pose(arm, rows)
        turned = wrapped(swivel - at.swivel) * 0.3
        return np.hstack([wrist - at.wrist, turned[:, None]])

    for _ in range(40):
        error = miss(q)
        if np.abs(error).max() < 1e-9:
            break
        h = 1e-6
        J = np.stack([(error - miss(q + h * row)) / h for row in np.eye(7)[:4]], axis=2)
        A = np.swapaxes(J, 1, 2) @ J + 1e-7 * np.eye(4)
        step = np.linalg.solve(A, np.swapaxes(J, 1, 2) @ error[..., None])[..., 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        q[:, :4] += step * np.minimum(1, 0.3 / np.maximum(longest, 1e-300))
    return q


def oriented(arm: Arm, q: Array, hand: Array) -> Array:
    """Postures (T, 7) with forearm and wrist turned toward orientations (T, 3, 3)."""
    q = q.copy()
    for _ in range(10):
        at = pose(arm, q)
        spin = _spin(hand @ np.swapaxes(at.hand, 1, 2))
        A = np.swapaxes(at.axes[:, 4:], 1, 2)
        B = np.swapaxes(A, 1, 2) @ A + 1e-2 * np.eye(3)
        q[:, 4:] += np.linalg.solve(B, np.swapaxes(A, 1, 2) @ spin[..., None])[..., 0]
    return q


def _spin(E: Array) -> Array:
    """Rotation vectors of rotations (T, 3, 3), to first order."""
    return np.stack([E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0],
                     E[:, 1, 0] - E[:, 0, 1]], axis=1) / 2  # fmt: skip


def steadied(arm: Arm, q: Array, position: Array, hand: Array) -> Array:
    """Postures nearest to `q` (T, 7) with the hand at poses (T, 3) m, (T, 3, 3)."""
    for _ in range(3):
        at = pose(arm, q)
        spin = _spin(hand @ np.swapaxes(at.hand, 1, 2))
        error = np.hstack([position - at.knuckle, spin])
        J = at.jacobian
        A = J @ np.swapaxes(J, 1, 2) + 1e-8 * np.eye(6)
        weights = np.linalg.solve(A, error[..., None])
        q = q + (np.swapaxes(J, 1, 2) @ weights)[..., 0]
    return q


class Walk(NamedTuple):
    """Postures of P held hands along their self-motion.

    Parameters
    ----------
    start : (P,) array
        Swivel where the walk began, rad.
    ways : list of P splines
        From the turn since then to the posture (7,), rad; None where the walk came to
        a posture from which the hand cannot be held.
    position, hand : (P, 3) and (P, 3, 3) arrays
        Of the hands.
    """

    start: Array
    ways: list[CubicSpline | None]
    position: Array
    hand: Array


def walk(arm: Arm, start: Array, *, farthest: float) -> Walk:
    """Walk P arms (P, 7) along the null direction of their own Jacobian, either way.

    `farthest` is how far the elbow turns to either side, rad.
    """
    first = pose(arm, start)
    steps = int(np.ceil(1.1 * farthest / _STEP))
    half = []
    for sign in (-1.0, 1.0):
        q, before = start, None
        rows = []
        for _ in range(steps):
            at = pose(arm, q)
            n = np.linalg.svd(at.jacobian)[2][:, -1]
            if before is None:
                ahead = pose(arm, q + 1e-5 * n).swivel
                n = n * np.sign(sign * wrapped(ahead - at.swivel))[:, None]
            else:
                n = n * np.sign(np.sum(n * before, axis=1))[:, None]
            before = n
            rate = np.abs(wrapped(pose(arm, q + 1e-5 * n).swivel - at.swivel)) / 1e-5
            q = q + n * (_STEP / np.maximum(rate, 0.2))[:, None]
            q = steadied(arm, q, first.knuckle, first.hand)
            rows.append(q)
        half.append(rows)
    table = np.array([*half[0][::-1], start, *half[1]])
    places = [pose(arm, row) for row in table]
    turned = np.array([wrapped(at.swivel - first.swivel) for at in places])
    off = np.array([np.abs(at.knuckle - first.knuckle).max(axis=1) for at in places])
    held = (off.max(axis=0) < 1e-3) & (np.diff(turned, axis=0) > 0).all(axis=0)
    held &= (turned[0] < -farthest) & (turned[-1] > farthest)
    ways = [
        CubicSpline(turned[:, k], table[:, k]) if held[k] else None
        for k in range(len(start))
    ]
    return Walk(first.swivel, ways, first.knuckle, first.hand)


__all__ = [
    "EASY", "Arm", "Pose", "Walk", "oriented", "other_body", "pose", "posed",
    "steadied", "walk", "wrapped",
]  # fmt: skip
