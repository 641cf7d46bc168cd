"""One arm of a virtual subject: its inverse kinematics and self-motion.

The self-motion comes from the Jacobian alone: each step follows the null direction, and
Newton steps then restore the hand pose. Directions learned from a recording are not
used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ikns._kernels.body.reach import reach_poses
from ikns.body.chains import SIDES, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.numerics.subspace import null_space

Array = NDArray[np.float64]

#: Hand pose error at which Newton's method stops, m and rad: a thousandth of the 0.1 mm
#: that cameras resolve, far above rounding.
POSE_TOLERANCE = 1e-7
#: Largest change of a joint in a Newton step, rad.
_LONGEST_STEP = 0.3
#: Step along the self-motion, rad of joint-space length. A cubic spline through the
#: steps is then accurate to about stride^4 / 384 = 1e-8 rad.
_STRIDE = 0.04
#: Clavicle angle with the upper arm forward, rad. Sternoclavicular elevation of 6 to
#: 10 deg and a protraction of the same order go with raising the arm to the front
#: (recalled from Ludewig et al. 2009, J Bone Joint Surg Am 91:378; rounded).
GIRDLE_FOLLOW = np.radians(8.0)
#: Distance of the self-motion from all joint limits, rad: people do not hold a hand
#: still with a joint at its limit.
_MARGIN = np.radians(5.0)


class ArmKinematics:
    """The kinematics of one arm, clavicle included.

    A *posture* is the arm's (9,) angles in the order of the chain ``*_arm_clavicle``;
    `angles` are the (18,) joint angles of the whole body.
    """

    def __init__(self, skeleton: Skeleton, side: str) -> None:
        if side not in SIDES:
            raise InvalidInput(f"expected a side of right or left, found '{side}'.")
        self.skeleton, self.side, self.chain = skeleton, side, f"{side}_arm"
        names = skeleton.joint_names
        self.columns = [names.index(j) for j in chain_joints(f"{side}_arm_clavicle")]
        self.lower = skeleton.lower[self.columns]
        self.upper = skeleton.upper[self.columns]
        self._seven = np.array(self.columns[2:])
        joints = chain_joints(self.chain)
        self._path = skeleton.paths((f"{side}_knuckle",), joints)
        self.outward = 1.0 if side == "right" else -1.0

    def put(self, angles: Array, posture: ArrayLike) -> Array:
        """Return joint angles of the body with this arm in a posture."""
        changed = np.array(angles)
        changed[self.columns] = posture
        return changed

    def hand(self, angles: Array) -> tuple[Array, Array]:
        """Return hand position (3,) m and orientation (3, 3) in the thorax frame."""
        return self.skeleton.link_in_thorax(angles, f"{self.side}_knuckle")

    def shoulder(self, angles: Array) -> Array:
        """Return the shoulder joint center in the thorax frame, (3,) m."""
        return self.skeleton.link_in_thorax(angles, f"{self.side}_upper_arm")[0]

    def swivel(self, angles: Array) -> float:
        """Return the elbow angle about the line from shoulder to wrist, rad.

        Zero with the elbow below the line, positive where it is raised outwards; NaN
        for a straight arm.
        """
        return float(self.skeleton.swivel(angles)[SIDES.index(self.side)])

    def to_pose(self, angles: Array, position: Array, rotation: Array) -> Array:
        """Return the posture nearest to `angles` that puts the hand at a pose.

        Newton's method with minimum-norm steps of the seven arm joints, which do not
        move along the self-motion and leave the clavicle as it is. The pose is in the
        thorax frame.
        """
        return self.to_poses(angles[None], position[None], rotation[None])[0]

    def to_poses(self, angles: Array, position: Array, rotation: Array) -> Array:
        """Do so for T postures (T, 18), and poses (T, 3) m and (T, 3, 3)."""
        found = np.array(angles, dtype=np.float64, order="C")
        missed = reach_poses(
            self._path,
            self._seven,
            np.array(position, dtype=np.float64),
            np.array(rotation, dtype=np.float64),
            POSE_TOLERANCE,
            _LONGEST_STEP,
            found,
        )
        if missed < 0:
            return found
        place = np.round(position[missed], 3)
        raise InvalidInput(
            f"the {self.side} hand cannot be brought to {place} m (thorax frame) in "
            "the orientation asked for; choose a nearer point."
        )


def girdle(posture: Array, rest: Array, *, follow: float) -> Array:
    """Return the clavicle angles for an arm's posture (9,), (2,) rad.

    ``protraction = rest + follow * sin(flexion)``,
    ``elevation = rest + follow * (1 - cos(abduction) cos(flexion))``:
    both are at `rest` (2,) with a hanging arm, and `follow` more with the arm forward.
    """
    abduction, flexion = posture[2:4]
    return rest + follow * np.array(
        [np.sin(flexion), 1 - np.cos(abduction) * np.cos(flexion)]
    )


@dataclass(frozen=True)
class SelfMotion:
    """Postures of one arm (K, 9) with one hand pose, by increasing swivel (K,), rad."""

    swivel: Array
    postures: Array

    def at(self, swivel: ArrayLike) -> Array:
        """Return the postures at elbow swivels (rad), (..., 9)."""
        return np.asarray(CubicSpline(self.swivel, self.postures)(swivel))


def self_motion(
    arm: ArmKinematics,
    angles: Array,
    *,
    lowest: float,
    highest: float,
    girdle_follow: float = 0.0,
) -> SelfMotion:
    """Follow the self-motion from a posture in both directions.

    Each step goes along the null direction of the pose Jacobian and is then corrected
    to the hand pose of the start. It ends before a joint comes near its limit, or at
    the swivels `lowest` and `highest`, rad; `girdle_follow` as in :func:`girdle`.
    """
    position, rotation = arm.hand(angles)
    start = angles[arm.columns]
    rest = start[:2] - girdle(start, np.zeros(2), follow=girdle_follow)
    swivels, postures = [arm.swivel(angles)], [start]
    for sign in (1.0, -1.0):
        current, swivel = angles, swivels[0 if sign < 0 else -1]
        ahead: Array | None = None
        while lowest < swivel < highest:
            null = np.append(
                np.zeros(2),
                null_space(arm.skeleton.chain_jacobian(current, arm.chain))[0],
            )
            if ahead is None:
                posture = current[arm.columns]
                turned = arm.swivel(arm.put(current, posture + 1e-4 * null)) - swivel
                ahead = null * np.sign(turned) * sign
            ahead = null * np.sign(null @ ahead)
            posture = current[arm.columns] + _STRIDE * ahead
            posture[:2] = girdle(posture, rest, follow=girdle_follow)
            current = arm.to_pose(arm.put(current, posture), position, rotation)
            before, swivel = swivel, arm.swivel(current)
            posture = current[arm.columns]
            stopped = np.minimum(posture - arm.lower, arm.upper - posture) < _MARGIN
            if stopped[2:].any() or sign * (swivel - before) < 0.1 * _STRIDE:
                break
            end = len(swivels) if sign > 0 else 0
            swivels.insert(end, swivel)
            postures.insert(end, posture)
    return SelfMotion(np.array(swivels), np.array(postures))
