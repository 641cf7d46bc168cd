"""The way of the hand over the table, and what the elbow can do all along it.

The hand comes down over the object and carries it over half an ellipse to the goal; it
turns about the vertical as the arm turns about the shoulder, and in no other way. At
some places of the way the self-motion is followed by the Jacobian, as everywhere in
this simulation, and between them interpolated: the body knows nothing of any map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ikns.errors import InvalidInput
from ikns.simulation.arm import Arm, SelfMotion, self_motion
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.operator.cohort import Participant, tracking_place

__all__ = ["BEYOND", "DOWN", "LEVELS", "LIFT", "Route", "hand_route"]

Array = NDArray[np.float64]
Piece = tuple[Array, Array, Array]

#: Where object and goal are among the points of the calibration, as shares of their
#: box, forward and outwards (assumptions: the paper shows two places on a table), and
#: how high: the lowest of these where the elbow has room all the way.
START, GOAL = (0.5, 0.8), (0.5, 0.2)
LEVELS = (0.15, 0.3, 0.45, 0.6)
#: How high the hand comes from and how high it carries, m (assumptions).
DOWN, LIFT = 0.12, 0.12
#: The elbow goes farther than it does while tracking, by this share of that range at
#: either end, where joints let it (assumption): nobody stops with the finger half open.
BEYOND = 0.2
#: A place is no good where it can go less far than this share of that range.
_LEAST = 0.8
#: Places at which the self-motion is followed: on the way down and on the arch; and
#: swivels at which it is kept.
_ON_COLUMN, _ON_ARCH, _EVEN = 4, 9, np.linspace(0.0, 1.0, 25)


@dataclass(frozen=True)
class Route:
    """Postures on the way.

    The place `s` on the way is -1 above the object, 0 at it, 1 at the goal.

    Parameters
    ----------
    arm : Arm
    angles : (18,) array
        The rest of the body.
    start, goal : (3,) array
        Hand at the object and at the goal, thorax frame, m.
    rotation : (3, 3) array
        Of the hand at the object.
    shoulder : (3,) array
        Its joint center, m.
    swivel : (float, float)
        Elbow swivels that are limb 0 and 1, rad.
    pieces : tuple of (knots, ranges, rows)
        On the way down and on the arch: (K,) places where the self-motion is known;
        (K, 2) swivels that can be reached there, rad; and (K, U, C) at even steps
        between those: posture (9), pseudo-inverse of the Jacobian (42), what skin adds
        to the markers (3 each).
    """

    arm: Arm
    angles: Array
    start: Array
    goal: Array
    rotation: Array
    shoulder: Array
    swivel: tuple[float, float]
    pieces: tuple[Piece, Piece]

    def hand(self, s: float) -> Array:
        """Where the hand is meant to be, thorax frame, (3,) m."""
        return _way(self.start, self.goal, s)

    def turn(self, s: float) -> float:
        """How far the hand has turned about the vertical since the object, rad."""
        return _yaw(self.shoulder, self.start, self.hand(max(s, 0.0)))

    def row(self, s: float, limb: float) -> Array:
        """Posture, pseudo-inverse and skin with the limb (0 to 1) at a place."""
        knots, ranges, rows = self.pieces[0 if s < 0 else 1]
        first, along = _four(knots, s)
        here = slice(first, first + 4)
        low, high = along @ ranges[here]
        wanted = self.swivel[0] + limb * (self.swivel[1] - self.swivel[0])
        share = min(max((wanted - low) / (high - low), 0.0), 1.0)
        second, across = _four(_EVEN, share)
        block = rows[here, second : second + 4]
        return np.asarray(np.outer(along, across).ravel() @ block.reshape(16, -1))

    def posture(self, s: float, limb: float) -> Array:
        """Joint angles of the body, (18,), the hand where it is meant to be."""
        return self.arm.put(self.angles, self.row(s, limb)[:9])


def hand_route(participant: Participant, *, height: float = 0.0) -> Route:
    """Find the way of a participant's hand.

    Parameters
    ----------
    participant : Participant
    height : float
        Of object and goal over the usual, m.

    Raises
    ------
    InvalidInput
        When the hand cannot get there, or the elbow has no room, at any level.
    """
    reason: InvalidInput | None = None
    for level in LEVELS:
        try:
            return _at_level(participant, level, height)
        except InvalidInput as error:
            reason = error
    raise InvalidInput(f"no way for the hand over a table: {reason}")


def _at_level(participant: Participant, level: float, height: float) -> Route:
    run = participant.protocol
    arm = Arm(run.subject.skeleton, run.side)
    labels = arm.skeleton.marker_set.labels
    columns = participant.subject.skeleton.marker_set.columns(labels)
    low_corner, high_corner = run.places.min(axis=0), run.places.max(axis=0)
    if arm.outward < 0:
        low_corner[2], high_corner[2] = high_corner[2], low_corner[2]
    start, goal = (
        low_corner + np.array([x, level, z]) * (high_corner - low_corner)
        for x, z in (START, GOAL)
    )
    start[1] += height
    goal[1] += height
    # The hand is held as this person would hold it halfway.
    angles, rest = tracking_place(run, (start + goal) / 2)
    assert rest.motion is not None
    low, high = (float(x) for x in rest.motion.swivel[[0, -1]])
    more = BEYOND * (high - low)
    body = arm.put(angles, rest.posture)
    shoulder = arm.shoulder(body)

    def turned(s: float) -> Array:
        yaw = _yaw(shoulder, rest.position, _way(start, goal, max(s, 0.0)))
        return np.asarray(Rotation.from_rotvec([0, yaw, 0]).as_matrix() @ rest.rotation)

    def motion(s: float, near: Array) -> SelfMotion:
        position = _way(start, goal, s)
        here = arm.to_pose(near, position, turned(s))
        swivel = arm.swivel(here)
        found = self_motion(
            arm,
            here,
            lowest=min(low - more, swivel - more),
            highest=max(high + more, swivel + more),
        )
        if np.ptp(found.swivel) < _LEAST * (high - low) or len(found.swivel) < 4:
            raise InvalidInput(
                f"the elbow has no room to swivel with the {arm.side} hand at "
                f"{np.round(position, 3)} m in the thorax frame."
            )
        return found

    pieces = []
    for knots in (np.linspace(-1, 0, _ON_COLUMN), np.linspace(0, 1, _ON_ARCH)):
        found: list[SelfMotion] = []
        for s in knots:
            found.append(motion(float(s), body))
            # The next place is sought from the middle of what this one allows.
            first, last = found[-1].swivel[[0, -1]]
            body = arm.put(angles, found[-1].at(np.clip((low + high) / 2, first, last)))
        ranges = np.array([m.swivel[[0, -1]] for m in found])
        rows = [_rows(arm, angles, m, run.skin, columns) for m in found]
        pieces.append((knots, ranges, np.array(rows)))
    return Route(
        arm,
        angles,
        start,
        goal,
        turned(0.0),
        shoulder,
        (low, high),
        (pieces[0], pieces[1]),
    )


def _way(start: Array, goal: Array, s: float) -> Array:
    if s < 0:
        return np.asarray(start + [0.0, -s * DOWN, 0.0])
    share = (1 - np.cos(np.pi * s)) / 2
    return np.asarray(
        start + share * (goal - start) + [0.0, LIFT * np.sin(np.pi * s), 0.0]
    )


def _yaw(shoulder: Array, before: Array, now: Array) -> float:
    """Turn about the thorax's Y from one place to another, seen from the shoulder."""
    (x0, z0), (x1, z1) = (before - shoulder)[[0, 2]], (now - shoulder)[[0, 2]]
    return float(np.arctan2(z0 * x1 - x0 * z1, x0 * x1 + z0 * z1))


def _rows(
    arm: Arm,
    angles: Array,
    motion: SelfMotion,
    skin: SoftTissue | None,
    columns: NDArray[np.intp],
) -> Array:
    bodies = np.array([arm.put(angles, posture) for posture in motion.postures])
    inverse = [
        np.linalg.pinv(arm.skeleton.chain_jacobian(body, arm.chain)).ravel()
        for body in bodies
    ]
    q = np.hstack([np.tile(arm.skeleton.neutral()[:7], (len(bodies), 1)), bodies])
    shift = np.zeros((len(q), len(columns), 3))
    if skin is not None:
        shift = skin.in_world(q, skin.with_posture(q))[:, columns]
    rows = np.hstack([motion.postures, inverse, shift.reshape(len(q), -1)])
    even = motion.swivel[0] + np.ptp(motion.swivel) * _EVEN
    return np.asarray(CubicSpline(motion.swivel, rows)(even))


def _four(knots: Array, x: float) -> tuple[int, Array]:
    """First of the four even knots about x, and the weights of the cubic through them.

    >>> _four(np.arange(6.0), 2.5)
    (1, array([-0.0625,  0.5625,  0.5625, -0.0625]))
    """
    at = (x - knots[0]) / (knots[1] - knots[0])
    first = min(max(int(at) - 1, 0), len(knots) - 4)
    t = at - first
    a, b, c, d = t, t - 1, t - 2, t - 3
    weights = np.array([-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6])
    return first, weights
