"""The self-motion of an arm in closed form, and a hand that turns.

With wrist and hand held, the arm turns as one about the line from shoulder to wrist:
elbow flexion stays, and pronation and wrist take the turn back. No Jacobian, no steps,
no joint limits: a swivel of 20 deg is 20 deg, whatever the model's joints say.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton

Array = np.ndarray
#: Carrying angle of the right arm between elbow and forearm, rad (urdf/README).
_CARRYING = -0.226893


def _columns(skeleton: Skeleton, side: str) -> list[int]:
    return [skeleton.joint_names.index(joint) for joint in chain_joints(f"{side}_arm")]


def held_hand(
    skeleton: Skeleton,
    side: str,
    angles: Array,
    swivel: Array,
    *,
    drift: Array | float = 0.0,
    tilt: Array | float = 0.0,
) -> Array:
    """Turn arms by a swivel while hand and wrist stay where they are.

    Parameters
    ----------
    skeleton : Skeleton
    side : str
    angles : (N, 18) array
        All joint angles, rad.
    swivel : (N,) array
        Turn about the line from shoulder to wrist, rad; the elbow rises with it.
    drift : (N, 3) array
        Displacement of the wrist, m: the shoulder turns to follow.
    tilt : (N, 3) array
        Rotation vector by which the hand turns in the thorax, rad.

    Returns
    -------
    (N, 18) array
    """
    sign = 1.0 if side == "right" else -1.0
    out = np.array(angles)
    shoulder, upper = skeleton.link_in_thorax(angles, f"{side}_upper_arm")
    wrist, hand = skeleton.link_in_thorax(angles, f"{side}_hand")
    girdle = skeleton.link_in_thorax(angles, f"{side}_clavicle")[1]
    n = wrist - shoulder
    length = np.linalg.norm(n, axis=1, keepdims=True)
    n /= length
    to = n + np.broadcast_to(drift, n.shape) / length
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    cross = np.cross(n, to)
    size = np.linalg.norm(cross, axis=1, keepdims=True)
    angle = np.arcsin(np.clip(size, -1, 1)) / np.maximum(size, 1e-300)
    follow = Rotation.from_rotvec(cross * angle)
    # Outwards is by the left-hand rule about the line to a right wrist.
    turn = Rotation.from_rotvec(to * (-sign * np.asarray(swivel))[:, None]) * follow
    upper = turn * Rotation.from_matrix(upper)
    tilted = Rotation.from_rotvec(np.array(np.broadcast_to(tilt, n.shape)))
    hand = tilted * Rotation.from_matrix(hand)
    columns = _columns(skeleton, side)
    flexion = angles[:, [columns[3]]]
    three = (Rotation.from_matrix(girdle).inv() * upper).as_euler("XZY")
    out[:, columns[:3]] = three * [-sign, 1.0, sign]
    forearm = (
        upper
        * Rotation.from_euler("Z", flexion)
        * Rotation.from_euler("X", sign * _CARRYING)
    )
    three = (forearm.inv() * hand).as_euler("YXZ")
    out[:, columns[4:]] = three * [sign, sign, -1.0]
    return out


def turned_hand(
    skeleton: Skeleton, side: str, angles: Array, *, pronation: float = 0.0
) -> Array:
    """Pronate forearms by an angle, rad; elbow and wrist stay, the hand turns."""
    out = np.array(angles)
    out[:, _columns(skeleton, side)[4]] += pronation
    return out
