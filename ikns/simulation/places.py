"""Where the hand goes: comfortable postures, and the points of the calibration box.

The box stands in front of the shoulder in the thorax frame (X forward, Y up, Z right)
and grows with the arm. Its far corners leave the elbow bent by 60 deg or so and its
near ones by 120 deg: the dexterous region, without its boundary.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ikns.errors import InvalidInput
from ikns.simulation.arm import Arm, SelfMotion, girdle, self_motion

__all__ = [
    "Place",
    "box_points",
    "comfortable_posture",
    "explored_places",
    "random_place",
]

Array = NDArray[np.float64]

#: Box for the hand, from the shoulder joint, in arm lengths (shoulder to knuckles):
#: forward, up, and outwards. In a hundred subjects, on both arms, the elbow can swivel
#: by 55 deg or more at every point.
BOX_LOW = np.array([0.42, -0.42, -0.27])
BOX_HIGH = np.array([0.70, 0.10, 0.27])
#: "Near" the vertices of an imagined box: error per axis, m (assumption).
_VERTEX_SD = 0.012
#: Size of what two hands hold between them, and how far its middle goes sideways, m.
_OBJECT, _SIDEWAYS = 0.30, 0.20
#: Swivel that people explore: from the elbow straight below the shoulder-wrist line to
#: nearly level with it, rad (assumption; joint limits cut it further).
LOWEST, HIGHEST = np.radians(0.0), np.radians(80.0)
#: Farthest that the elbow swivels to either side of its comfortable place, rad.
_FARTHEST = np.radians([30.0, 40.0])
#: A place is no good when the elbow can swivel by less than this in all, rad.
_LEAST = np.radians(40.0)
#: Clavicle angle with the upper arm forward, rad. Sternoclavicular elevation of 6 to
#: 10 deg and a protraction of the same order go with raising the arm to the front
#: (recalled from Ludewig et al. 2009, J Bone Joint Surg Am 91:378; rounded).
GIRDLE_FOLLOW = np.radians(8.0)


@dataclass(frozen=True)
class Place:
    """A hand pose with the postures that hold it.

    Parameters
    ----------
    posture : (9,) array
        The comfortable posture there, rad.
    position : (3,) array
        Hand in the thorax frame, m.
    rotation : (3, 3) array
        Hand orientation in the thorax frame.
    swivel : float
        Elbow swivel of the comfortable posture, rad.
    motion : SelfMotion or None
        The postures that can be explored; None where nobody explores.
    """

    posture: Array
    position: Array
    rotation: Array
    swivel: float
    motion: SelfMotion | None = None


def comfortable_posture(
    arm: Arm,
    angles: Array,
    position: Array,
    *,
    swivel: float,
    wrist: Array,
    girdle_rest: Array,
) -> Array:
    """Posture with the hand at a position, the elbow at a swivel, and a given wrist.

    Parameters
    ----------
    arm : Arm
        The arm.
    angles : (18,) array
        The rest of the body.
    position : (3,) array
        Hand in the thorax frame, m.
    swivel : float
        Elbow swivel, rad.
    wrist : (3,) array
        Pronation, wrist flexion and deviation, rad.
    girdle_rest : (2,) array
        Clavicle angles with the arm hanging, rad.

    Raises
    ------
    InvalidInput
        When the position is out of reach.
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
    arm: Arm, angles: Array, *, rng: np.random.Generator, girdle_rest: Array
) -> Place:
    """Return a place somewhere in the box, in any comfortable posture."""
    position = _from_box(arm, angles, rng.uniform(BOX_LOW, BOX_HIGH))
    posture = comfortable_posture(
        arm,
        angles,
        position,
        swivel=rng.uniform(np.radians(15), np.radians(65)),
        wrist=rng.normal(0.0, np.radians([20, 8, 5])),
        girdle_rest=girdle_rest,
    )
    return _place(arm, angles, posture)


def box_points(
    arms: Sequence[Arm], angles: Array, *, n: int, rng: np.random.Generator
) -> list[Array]:
    """Where each hand goes at the points of the protocol, one (n, 3) array an arm, m.

    Near the vertices of the box, then near the centers of its upper and lower face; the
    upper points come first. Fewer than 10 are the first ones. Two hands hold an object
    between them, and the box is that of its middle.
    """
    corners = itertools.product((1, 0), ((1, 0), (1, 1), (0, 1), (0, 0)))
    shares = [(x, y, z) for y, (x, z) in corners] + [(0.5, 1, 0.5), (0.5, 0, 0.5)]
    if not 1 <= n <= len(shares):
        raise InvalidInput(f"n_points must be 1 to {len(shares)}, not {n}.")
    share = np.array(shares[:n], dtype=np.float64)
    goals = BOX_LOW + share * (BOX_HIGH - BOX_LOW)
    near = rng.normal(0.0, _VERTEX_SD, (n, 3))
    if len(arms) == 1:
        return [_from_box(arms[0], angles, goals) + near]
    ahead = [_from_box(arm, angles, goals * [1, 1, 0]) for arm in arms]
    middle = np.mean(ahead, axis=0) + near
    middle[:, 2] += (share[:, 2] - 0.5) * _SIDEWAYS
    half = np.array([0.0, 0.0, _OBJECT / 2])
    return [middle + half * arm.outward for arm in arms]


def explored_places(
    arm: Arm,
    angles: Array,
    positions: Array,
    *,
    rng: np.random.Generator,
    girdle_rest: Array,
    girdle_follow: float,
) -> list[Place]:
    """Return places to explore at these hand positions, each with its self-motion.

    The forearm's pronation is the one, of a few, that leaves the elbow most room.

    Parameters
    ----------
    arm : Arm
        The arm.
    angles : (18,) array
        The rest of the body.
    positions : (n, 3) array
        Hand in the thorax frame, m.
    rng : numpy.random.Generator
        Source of the person's habits.
    girdle_rest, girdle_follow
        See :func:`ikns.simulation.arm.girdle`; `girdle_follow` while the hand is held.

    Raises
    ------
    InvalidInput
        When a position is out of reach, or leaves the elbow no room.
    """
    comfortable = rng.normal(np.radians(38.0), np.radians(4.0))
    places = []
    for position in positions:
        swivel = comfortable + rng.normal(0.0, np.radians(3.0))
        farthest = rng.uniform(*_FARTHEST)
        habit = rng.normal(0.0, np.radians([8, 4, 3]))
        best: Place | None = None
        for turn in np.radians([0.0, 25.0, -25.0]):
            if best is not None and _room(best.motion) > 0.9 * 2 * farthest:
                break
            posture = comfortable_posture(
                arm,
                angles,
                position,
                swivel=swivel,
                wrist=habit + [turn, 0.0, 0.0],
                girdle_rest=girdle_rest,
            )
            motion = self_motion(
                arm,
                arm.put(angles, posture),
                lowest=max(LOWEST, swivel - farthest),
                highest=min(HIGHEST, swivel + farthest),
                girdle_follow=girdle_follow,
            )
            if best is None or _room(motion) > _room(best.motion) + np.radians(3.0):
                best = _place(arm, angles, posture, motion)
        if best is None or _room(best.motion) < _LEAST:
            raise InvalidInput(
                f"the elbow has no room to swivel with the {arm.side} hand at "
                f"{np.round(position, 3)} m in the thorax frame; draw another subject."
            )
        places.append(best)
    return places


def _place(
    arm: Arm, angles: Array, posture: Array, motion: SelfMotion | None = None
) -> Place:
    body = arm.put(angles, posture)
    return Place(posture, *arm.hand(body), arm.swivel(body), motion)


def _room(motion: SelfMotion | None) -> float:
    return 0.0 if motion is None else float(motion.swivel[-1] - motion.swivel[0])


def _from_box(arm: Arm, angles: Array, share: Array) -> Array:
    """Positions in the thorax frame of places in arm lengths from the shoulder."""
    lengths = arm.skeleton.segment_lengths
    reach = sum(lengths[f"{arm.side}_{s}"] for s in ("upper_arm", "forearm", "hand"))
    return arm.shoulder(angles) + reach * share * np.array([1.0, 1.0, arm.outward])
