"""One arm of a virtual subject: its inverse kinematics and self-motion.

The self-motion comes from the Jacobian alone: each step follows the null direction, and
Newton steps then restore the hand pose. Directions learned from a recording are not
used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ikns._kernels.body.paths import Paths
from ikns._kernels.body.reach import reach_poses
from ikns._kernels.body.self_motion import follow_self_motion
from ikns.arrays import Array
from ikns.body.chains import SIDES, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput

#: Hand pose error at which Newton's method stops, m and rad: a thousandth of the 0.1 mm
#: that cameras resolve, far above rounding.
POSE_TOLERANCE = 1e-7
#: Largest change of a joint in a Newton step, rad.
_LONGEST_STEP = 0.3
#: Step along the self-motion, rad of joint-space length. A cubic spline through the
#: steps is then accurate to about stride^4 / 384 = 1e-8 rad.
_STRIDE = 0.04
#: A step that changes the swivel by less is the last one, rad; so there are no more.
_LEAST_STEP = 0.1 * _STRIDE
_MOST_STEPS = int(2 * np.pi / _LEAST_STEP) + 2
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

    @cached_property
    def swivel_paths(self) -> tuple[Paths, Paths, int]:
        """Paths to the hand and to both elbows, and which of these is this arm's."""
        return self._path, self.skeleton.elbow_paths, SIDES.index(self.side)

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
    angles = np.array(angles, dtype=np.float64)
    start = angles[arm.columns]
    rest = start[:2] - girdle(start, np.zeros(2), follow=girdle_follow)
    swivels, postures = [np.array([arm.swivel(angles)])], [start[None]]
    for sign in (-1.0, 1.0):
        found = np.empty(_MOST_STEPS), np.empty((_MOST_STEPS, len(arm.columns)))
        count = follow_self_motion(
            *arm.swivel_paths,
            np.array(arm.columns),
            np.array([arm.lower + _MARGIN, arm.upper - _MARGIN]),
            arm.hand(angles),
            sign,
            (float(lowest), float(highest)),
            (float(rest[0]), float(rest[1]), float(girdle_follow)),
            (_STRIDE, POSE_TOLERANCE, _LONGEST_STEP, _LEAST_STEP),
            angles,
            *found,
        )
        if count < 0:
            raise InvalidInput(
                f"the {arm.side} hand cannot be kept where it is while the elbow "
                "swivels; choose a nearer point."
            )
        at = len(swivels) if sign > 0 else 0
        order = slice(None, None, int(sign))
        swivels.insert(at, found[0][:count][order])
        postures.insert(at, found[1][:count][order])
    return SelfMotion(np.concatenate(swivels), np.concatenate(postures))
