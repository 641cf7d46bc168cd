"""The route of the hand over the table, with the self-motion along it.

The hand moves down to the object and carries it along half an ellipse to the goal; it
turns about the vertical as the arm turns about the shoulder. The self-motion is
computed from the Jacobian at some positions and interpolated between them. The
simulated body is independent of any map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.simulation.arm import ArmKinematics, SelfMotion, self_motion
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.body_frames import arm_rows
from ikns.simulation.operator.cohort import Participant, tracking_place

Piece = tuple[Array, Array, Array]

#: Positions of object and goal in the box of the calibration points, as shares forward
#: and outwards (assumptions: the paper shows two places on a table), and levels: the
#: lowest one at which the elbow has room on the whole route is taken.
START, GOAL = (0.5, 0.8), (0.5, 0.2)
LEVELS = (0.15, 0.3, 0.45, 0.6)
#: Height from which the hand moves down, and to which it lifts, m (assumptions).
DOWN, LIFT = 0.12, 0.12
#: The swivel range is larger than in tracking by this share at either end, within joint
#: limits (assumption): people do not stop with the finger half open.
EXTRA_RANGE = 0.2
#: Smallest swivel range on the route, as a share of that in tracking.
_LEAST = 0.8
#: Number of positions with a computed self-motion, on the way down and on the arch; and
#: relative swivels at which it is stored.
_ON_COLUMN, _ON_ARCH, _EVEN = 4, 9, np.linspace(0.0, 1.0, 25)


@dataclass(frozen=True)
class Route:
    """Postures along a route in the thorax frame.

    The position `s` on the route is -1 above the object, 0 at it, 1 at the goal.
    `rotation` is the orientation of the hand at the object, `shoulder` the joint
    center, `swivel` the elbow swivels at positions 0 and 1 of the limb, rad. `pieces`
    are, on the way down and on the arch, (K,) positions with a computed self-motion;
    (K, 2) swivel ranges there, rad; and (K, U, C) states of the arm at even steps in
    between, from :func:`ikns.simulation.body_frames.arm_rows`.
    """

    arm: ArmKinematics
    angles: Array
    start: Array
    goal: Array
    rotation: Array
    shoulder: Array
    swivel: tuple[float, float]
    pieces: tuple[Piece, Piece]

    def hand(self, s: float) -> Array:
        """Return the intended position of the hand, thorax frame, (3,) m."""
        return _position(self.start, self.goal, s)

    def turn(self, s: float) -> float:
        """Return the turn of the hand about the vertical since the object, rad."""
        return _yaw(self.shoulder, self.start, self.hand(max(s, 0.0)))

    def row(self, s: float, limb: float) -> Array:
        """Return the state of the arm for a position and a limb (0 to 1)."""
        knots, ranges, rows = self.pieces[0 if s < 0 else 1]
        first, along = _cubic_weights(knots, s)
        here = slice(first, first + 4)
        low, high = along @ ranges[here]
        wanted = self.swivel[0] + limb * (self.swivel[1] - self.swivel[0])
        share = min(max((wanted - low) / (high - low), 0.0), 1.0)
        second, across = _cubic_weights(_EVEN, share)
        block = rows[here, second : second + 4]
        return np.asarray(np.outer(along, across).ravel() @ block.reshape(16, -1))

    def posture(self, s: float, limb: float) -> Array:
        """Return the joint angles of the body, (18,), without drift."""
        return self.arm.put(self.angles, self.row(s, limb)[:9])


def hand_route(participant: Participant, *, height: float = 0.0) -> Route:
    """Find the route of a participant's hand.

    Object and goal are `height` above the usual, m.
    """
    reason: InvalidInput | None = None
    for level in LEVELS:
        try:
            return _at_level(participant, level, height)
        except InvalidInput as error:
            reason = error
    raise InvalidInput(f"no route for the hand over a table: {reason}")


def _at_level(participant: Participant, level: float, height: float) -> Route:
    run = participant.protocol
    arm = ArmKinematics(run.subject.skeleton, run.side)
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
    # The hand is held as this person holds it halfway.
    angles, rest = tracking_place(run, (start + goal) / 2)
    assert rest.motion is not None
    low, high = (float(x) for x in rest.motion.swivel[[0, -1]])
    more = EXTRA_RANGE * (high - low)
    body = arm.put(angles, rest.posture)
    shoulder = arm.shoulder(body)

    def turned(s: float) -> Array:
        yaw = _yaw(shoulder, rest.position, _position(start, goal, max(s, 0.0)))
        return np.asarray(Rotation.from_rotvec([0, yaw, 0]).as_matrix() @ rest.rotation)

    def motion(s: float, near: Array) -> SelfMotion:
        position = _position(start, goal, s)
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
            # The search for the next one starts in the middle of this range.
            first, last = found[-1].swivel[[0, -1]]
            body = arm.put(angles, found[-1].at(np.clip((low + high) / 2, first, last)))
        ranges = np.array([m.swivel[[0, -1]] for m in found])
        rows = [_even_rows(arm, angles, m, run.skin, columns) for m in found]
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


def _position(start: Array, goal: Array, s: float) -> Array:
    if s < 0:
        return np.asarray(start + [0.0, -s * DOWN, 0.0])
    share = (1 - np.cos(np.pi * s)) / 2
    return np.asarray(
        start + share * (goal - start) + [0.0, LIFT * np.sin(np.pi * s), 0.0]
    )


def _yaw(shoulder: Array, before: Array, now: Array) -> float:
    """Return the angle about the thorax's Y between two positions, at the shoulder."""
    (x0, z0), (x1, z1) = (before - shoulder)[[0, 2]], (now - shoulder)[[0, 2]]
    return float(np.arctan2(z0 * x1 - x0 * z1, x0 * x1 + z0 * z1))


def _even_rows(
    arm: ArmKinematics,
    angles: Array,
    motion: SelfMotion,
    skin: SoftTissue | None,
    columns: NDArray[np.intp],
) -> Array:
    """Return the states of the arm at even steps of the swivel."""
    rows = arm_rows(arm, angles, motion, skin=skin, columns=columns)
    even = motion.swivel[0] + np.ptp(motion.swivel) * _EVEN
    return np.asarray(CubicSpline(motion.swivel, rows)(even))


def _cubic_weights(knots: Array, x: float) -> tuple[int, Array]:
    """Return the first of four even knots around x, and the cubic's weights.

    >>> _cubic_weights(np.arange(6.0), 2.5)
    (1, array([-0.0625,  0.5625,  0.5625, -0.0625]))
    """
    at = (x - knots[0]) / (knots[1] - knots[0])
    first = min(max(int(at) - 1, 0), len(knots) - 4)
    t = at - first
    a, b, c, d = t, t - 1, t - 2, t - 3
    weights = np.array([-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6])
    return first, weights
