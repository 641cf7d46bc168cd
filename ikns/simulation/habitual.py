"""The posture of an arm by a person's habits: natural swivel, hands as real ones.

Wrist center and hinge swivel decide shoulder and elbow; the hand's orientation then
decides forearm and wrist, as far as they turn.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.simulation.arm import GIRDLE_FOLLOW, ArmKinematics, girdle
from ikns.simulation.posture_habits import PostureHabits, draw_hands

#: Distance from all joint limits, rad: a little room for drift.
_ROOM = np.radians(3.0)
#: Largest error of the wrist's place, m: more is out of reach.
_OUT_OF_REACH = 1e-3
#: A swivel that the shoulder's limits do not allow gives way: weight against the
#: wrist's place, m per rad.
_SWIVEL_WEIGHT = 0.02
#: The swivel depends on the hand, and the hand on the forearm: rounds of both.
_ROUNDS = 3
#: Where the search starts: shoulder and elbow, rad.
_EASY = np.array([0.4, 0.6, 0.0, 1.4])


def habitual_posture(
    arm: ArmKinematics,
    angles: Array,
    position: Array,
    rotation: Array,
    *,
    habits: PostureHabits,
    scatter: float,
    girdle_rest: Array,
) -> Array:
    """Return the posture (9,) for a place and an orientation of the hand.

    Parameters
    ----------
    arm : ArmKinematics
    angles : (18,) array
        Of the rest of the body, rad.
    position : (3,) array
        Of the knuckle in the thorax frame, m.
    rotation : (3, 3) array
        Of the hand in the thorax frame; forearm and wrist go as near as they can, and
        the wrist then to where the knuckle is at its place.
    habits : PostureHabits
    scatter : float
        Departure from the natural swivel at this rest, rad.
    girdle_rest : (2,) array
        Clavicle angles with the arm hanging, rad.

    Raises
    ------
    InvalidInput
        When the hand does not get there.
    """
    mirror = np.array([1.0, 1.0, arm.outward])
    low, high = arm.lower[2:] + _ROOM, arm.upper[2:] - _ROOM
    along = _knuckle_in_hand(arm, angles)
    distal, four, held = np.zeros(3), _EASY, rotation

    def raw(four: Array) -> Array:
        posture = np.concatenate([girdle_rest, four, distal])
        posture[:2] = girdle(posture, girdle_rest, follow=GIRDLE_FOLLOW)
        return posture

    def miss(four: Array) -> Array:
        body = arm.put(angles, raw(four))
        place = arm.skeleton.link_in_thorax(body, f"{arm.side}_hand")[0]
        off = float(arm_swivel(arm.skeleton, body, arm.chain)[1]) - goal
        off = (off + np.pi) % (2 * np.pi) - np.pi
        return np.append(place - wrist, _SWIVEL_WEIGHT * off)

    for _ in range(_ROUNDS):
        way = held @ along
        wrist = position - way
        axis = way / np.linalg.norm(way)
        goal = float(habits.swivel(wrist * mirror, axis * mirror)) + scatter
        start = np.clip(four, low[:4] + 1e-6, high[:4] - 1e-6)
        found = least_squares(miss, start, bounds=(low[:4], high[:4]), xtol=1e-9)
        four, distal = found.x, np.zeros(3)
        body = arm.put(angles, raw(four))
        forearm = arm.skeleton.link_in_thorax(body, f"{arm.side}_hand")[1]
        turned = Rotation.from_matrix(forearm.T @ rotation).as_euler("YXZ")
        distal = np.clip(turned * [arm.outward, arm.outward, -1.0], low[4:], high[4:])
        body = arm.put(angles, raw(four))
        held = arm.skeleton.link_in_thorax(body, f"{arm.side}_hand")[1]
    if np.abs(found.fun[:3]).max() > _OUT_OF_REACH:
        raise InvalidInput(
            f"the {arm.side} hand does not reach {np.round(position, 3)} m (thorax "
            "frame) with a bent elbow; choose a nearer point."
        )
    return raw(four)


def _knuckle_in_hand(arm: ArmKinematics, angles: Array) -> Array:
    wrist, rotation = arm.skeleton.link_in_thorax(angles, f"{arm.side}_hand")
    return np.asarray(rotation.T @ (arm.hand(angles)[0] - wrist))


def hand_drawn(
    arm: ArmKinematics, angles: Array, position: Array, *, rng: np.random.Generator
) -> Array:
    """Draw the orientation (3, 3) of a hand with its knuckle at a place (3,) m.

    Both in the thorax frame; as real hands are where reaches end.
    """
    mirror = np.diag([1.0, 1.0, arm.outward])
    lengths = arm.skeleton.segment_lengths
    length = lengths[f"{arm.side}_upper_arm"] + lengths[f"{arm.side}_forearm"]
    shoulder = arm.shoulder(angles)
    # The wrist is about a hand's length behind, toward the shoulder.
    way = position - shoulder
    near = way * (1 - lengths[f"{arm.side}_hand"] / np.linalg.norm(way))
    drawn = draw_hands(rng, (near @ mirror / length)[None])[0]
    return np.asarray(mirror @ drawn @ mirror)
