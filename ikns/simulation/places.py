"""Places of the hand: comfortable postures, and the points of the calibration box.

The box is in front of the shoulder in the thorax frame (X forward, Y up, Z right) and
scales with the arm. The elbow is bent by about 60 deg at its far corners and 120 deg at
its near ones: the dexterous region, without its boundary.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.simulation.arm import (
    GIRDLE_FOLLOW,
    ArmKinematics,
    SelfMotion,
    girdle,
    self_motion,
)

#: Corners of the box from the shoulder joint, in arm lengths (shoulder to knuckles):
#: forward, up, and outwards. In a hundred subjects, on both arms, the elbow can swivel
#: by 55 deg or more at every point.
BOX_LOW = np.array([0.42, -0.42, -0.27])
BOX_HIGH = np.array([0.70, 0.10, 0.27])
#: The hand is placed "near" the vertices of a box by people without habits: error per
#: axis, m (assumption; real people are 4 to 6 cm off).
VERTEX_SD = 0.012
#: Size of an object held between two hands, and sideways range of its middle, m.
_OBJECT, _SIDEWAYS = 0.30, 0.20
#: Range of the swivel that people explore, rad: from the elbow below the shoulder-wrist
#: line to nearly level with it (assumption; joint limits reduce it further).
LOWEST, HIGHEST = np.radians(0.0), np.radians(80.0)
#: Range of the largest swivel to either side of the comfortable one, rad.
_FARTHEST = np.radians([30.0, 40.0])
#: Smallest total range of the swivel at a place, rad.
_LEAST_RANGE = np.radians(40.0)
#: Turns of the forearm that are tried for a larger range, and the gain that is worth
#: another turn, rad.
_FOREARM_TURNS, _WORTH_TURNING = np.radians([0.0, 25.0, -25.0]), np.radians(3.0)


@dataclass(frozen=True)
class Place:
    """A hand pose in the thorax frame with the postures that hold it.

    `posture` (9,) is the comfortable one and `swivel` its elbow swivel, rad; `motion`
    holds the postures that can be explored, None where the place is not explored.
    """

    posture: Array
    position: Array
    rotation: Array
    swivel: float
    motion: SelfMotion | None = None

    @property
    def swivel_range(self) -> float:
        """Range of the swivel, rad; 0 without a self-motion."""
        swivel = None if self.motion is None else self.motion.swivel
        return 0.0 if swivel is None else float(swivel[-1] - swivel[0])


def comfortable_posture(
    arm: ArmKinematics,
    angles: Array,
    position: Array,
    *,
    swivel: float,
    wrist: Array,
    girdle_rest: Array,
) -> Array:
    """Return the posture for a hand position, an elbow swivel and a wrist posture.

    `wrist` (3,) is pronation, wrist flexion and deviation, rad; `girdle_rest` (2,) the
    clavicle angles with the arm hanging, rad.
    """

    def posture(four: Array) -> Array:
        raw = np.concatenate([girdle_rest, four, wrist])
        raw[:2] = girdle(raw, girdle_rest, follow=GIRDLE_FOLLOW)
        return raw

    def miss(four: Array) -> Array:
        body = arm.put(angles, posture(four))
        return np.append(
            arm.hand(body)[0] - position, 0.2 * (arm.swivel(body) - swivel)
        )

    inside = slice(2, 6)
    solution = least_squares(
        miss,
        [0.4, 0.6, 0.0, 1.4],
        bounds=(arm.lower[inside] + 0.05, arm.upper[inside] - 0.05),
        xtol=1e-10,
    )
    if np.abs(solution.fun).max() > 1e-5:
        raise InvalidInput(
            f"the {arm.side} hand does not reach {np.round(position, 3)} m (thorax "
            "frame) with a bent elbow; choose a nearer point."
        )
    return posture(solution.x)


def random_place(
    arm: ArmKinematics, angles: Array, *, rng: np.random.Generator, girdle_rest: Array
) -> Place:
    """Return a random place in the box, in a random comfortable posture."""
    position = from_box(arm, angles, rng.uniform(BOX_LOW, BOX_HIGH))
    posture = comfortable_posture(
        arm,
        angles,
        position,
        swivel=rng.uniform(np.radians(15), np.radians(65)),
        wrist=rng.normal(0.0, np.radians([20, 8, 5])),
        girdle_rest=girdle_rest,
    )
    return place_of(arm, angles, posture)


def box_points(
    arms: Sequence[ArmKinematics], angles: Array, *, n: int, near: Array | float = 0.0
) -> list[Array]:
    """Return the positions of each hand at the points of the protocol, (n, 3) m.

    They are the vertices of the box, the upper ones first, then the centers of its
    upper and lower face; fewer than 10 are the first ones. Two hands hold an object
    between them, whose middle is at the points. All are `near` (n, 3) m off.
    """
    corners = itertools.product((1, 0), ((1, 0), (1, 1), (0, 1), (0, 0)))
    shares = [(x, y, z) for y, (x, z) in corners] + [(0.5, 1, 0.5), (0.5, 0, 0.5)]
    if not 1 <= n <= len(shares):
        raise InvalidInput(f"expected n_points from 1 to {len(shares)}, found {n}.")
    share = np.array(shares[:n], dtype=np.float64)
    goals = BOX_LOW + share * (BOX_HIGH - BOX_LOW)
    if len(arms) == 1:
        return [from_box(arms[0], angles, goals) + near]
    ahead = [from_box(arm, angles, goals * [1, 1, 0]) for arm in arms]
    middle = np.mean(ahead, axis=0) + near
    middle[:, 2] += (share[:, 2] - 0.5) * _SIDEWAYS
    half = np.array([0.0, 0.0, _OBJECT / 2])
    return [middle + half * arm.outward for arm in arms]


def explored_places(
    arm: ArmKinematics,
    angles: Array,
    positions: Array,
    *,
    rng: np.random.Generator,
    girdle_rest: Array,
    girdle_follow: float,
) -> list[Place]:
    """Return places to explore at hand positions (n, 3), each with its self-motion.

    Of a few pronations of the forearm, the one with the largest swivel range is taken.
    The clavicle follows the arm by `girdle_follow` while the hand is held.
    """
    comfortable = rng.normal(np.radians(38.0), np.radians(4.0))
    places = []
    for position in positions:
        swivel = comfortable + rng.normal(0.0, np.radians(3.0))
        farthest = rng.uniform(*_FARTHEST)
        habit = rng.normal(0.0, np.radians([8, 4, 3]))
        places.append(
            widest_place(
                arm,
                angles,
                position,
                swivel=swivel,
                wrist=habit,
                girdle_rest=girdle_rest,
                lowest=max(LOWEST, swivel - farthest),
                highest=min(HIGHEST, swivel + farthest),
                girdle_follow=girdle_follow,
                enough=0.9 * 2 * farthest,
                remedy="draw another subject",
            )
        )
    return places


def widest_place(
    arm: ArmKinematics,
    angles: Array,
    position: Array,
    *,
    swivel: float,
    wrist: Array,
    girdle_rest: Array,
    lowest: float,
    highest: float,
    girdle_follow: float = 0.0,
    enough: float = np.inf,
    remedy: str,
) -> Place:
    """Return the place with the largest swivel range, of a few forearm turns.

    No further turn is tried once the range is `enough`. Other parameters as in
    :func:`comfortable_posture` and :func:`ikns.simulation.arm.self_motion`.

    Raises
    ------
    InvalidInput
        When the position is out of reach, or the swivel range is too small; `remedy`
        says what would be right.
    """
    best: Place | None = None
    for turn in _FOREARM_TURNS:
        if best is not None and best.swivel_range > enough:
            break
        posture = comfortable_posture(
            arm,
            angles,
            position,
            swivel=swivel,
            wrist=wrist + [turn, 0.0, 0.0],
            girdle_rest=girdle_rest,
        )
        motion = self_motion(
            arm,
            arm.put(angles, posture),
            lowest=lowest,
            highest=highest,
            girdle_follow=girdle_follow,
        )
        here = place_of(arm, angles, posture, motion)
        if best is None or here.swivel_range > best.swivel_range + _WORTH_TURNING:
            best = here
    if best is None or best.swivel_range < _LEAST_RANGE:
        raise InvalidInput(
            f"the elbow has no room to swivel with the {arm.side} hand at "
            f"{np.round(position, 3)} m in the thorax frame; {remedy}."
        )
    return best


def place_of(
    arm: ArmKinematics, angles: Array, posture: Array, motion: SelfMotion | None = None
) -> Place:
    """Return the place of an arm's posture (9,), rad."""
    body = arm.put(angles, posture)
    return Place(posture, *arm.hand(body), arm.swivel(body), motion)


def from_box(arm: ArmKinematics, angles: Array, share: Array) -> Array:
    """Convert positions from arm lengths off the shoulder to the thorax frame, m."""
    lengths = arm.skeleton.segment_lengths
    reach = sum(lengths[f"{arm.side}_{s}"] for s in ("upper_arm", "forearm", "hand"))
    return arm.shoulder(angles) + reach * share * np.array([1.0, 1.0, arm.outward])
