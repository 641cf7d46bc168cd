"""Joint angles as the International Society of Biomechanics reports them.

Wu et al. 2005, J Biomech 38(5):981-992. They are an output only: the method works on
the skeleton's own angles, in which the arm's self-motion is straighter (urdf/README).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton

_MIRROR = np.diag([1.0, 1.0, -1.0])


def isb_angles(skeleton: Skeleton, q: Array) -> dict[str, Array]:
    """Report the arms' angles in ISB's sequences.

    Parameters
    ----------
    skeleton : Skeleton
        The body.
    q : (T, nq) or (T, J) array
        Configurations, or joint angles alone. `Motion.angles` are NaN where a joint was
        not seen, and so is then what depends on it; `Motion.q` never is.

    Returns
    -------
    dict of (T,) arrays
        Radians, per side: ``plane_of_elevation`` (0 is abduction, 90 deg forward
        flexion), ``elevation``, ``axial_rotation`` (internal positive) of the upper arm
        in the thorax (Y-X-Y); ``elbow_flexion``, ``carrying_angle``, ``pronation``
        (0 is full supination) of the forearm in the upper arm (Z-X-Y);
        ``wrist_flexion`` and ``wrist_ulnar_deviation``. The left side is mirrored. At
        zero elevation only the sum of plane of elevation and axial rotation means
        anything, as in any Y-X-Y sequence.

    Examples
    --------
    >>> skeleton = Skeleton.load()
    >>> angles = isb_angles(skeleton, skeleton.neutral()[None])
    >>> angles["right_pronation"].round(4).tolist()
    [1.5708]
    """
    angles: dict[str, Array] = {}
    joints = q[:, -len(skeleton.joint_names) :]
    for side in SIDES:
        links = [
            skeleton.link_in_thorax(q, f"{side}_{link}")[1]
            for link in ("upper_arm", "forearm")
        ]
        if side == "left":
            links = [_MIRROR @ rotations @ _MIRROR for rotations in links]
        known = [np.isfinite(matrix.sum(axis=(1, 2))) for matrix in links]
        upper_arm, forearm = (
            Rotation.from_matrix(np.where(k[:, None, None], rotations, np.eye(3)))
            for k, rotations in zip(known, links, strict=True)
        )
        shoulder = _yxy(upper_arm)
        elbow = (upper_arm.inv() * forearm).as_euler("ZXY")
        shoulder[~known[0]], elbow[~known[1]] = np.nan, np.nan
        own = {
            "plane_of_elevation": shoulder[:, 0],
            "elevation": -shoulder[:, 1],
            "axial_rotation": shoulder[:, 2],
            "elbow_flexion": elbow[:, 0],
            # ISB's forearm has X forward with the palm forward; ours with the thumb.
            "carrying_angle": -elbow[:, 1],
            "pronation": elbow[:, 2] + np.pi / 2,
            "wrist_flexion": joints[
                :, skeleton.joint_names.index(f"{side}_wrist_flexion")
            ],
            "wrist_ulnar_deviation": joints[
                :, skeleton.joint_names.index(f"{side}_wrist_deviation")
            ],
        }
        angles |= {f"{side}_{name}": value for name, value in own.items()}
    return angles


def _yxy(rotation: Rotation) -> Array:
    """Y-X-Y angles with a negative middle angle, as ISB wants elevation, (T, 3) rad."""
    matrix = rotation.as_matrix()
    middle = -np.arccos(np.clip(matrix[:, 1, 1], -1.0, 1.0))
    # Element by element of Ry(a) Rx(b) Ry(c) with sin(b) <= 0.
    first = np.arctan2(-matrix[:, 0, 1], -matrix[:, 2, 1])
    last = np.arctan2(-matrix[:, 1, 0], matrix[:, 1, 2])
    level = np.sin(middle) > -1e-9
    first = np.where(level, 0.0, first)
    last = np.where(level, np.arctan2(matrix[:, 0, 2], matrix[:, 0, 0]), last)
    return np.stack([first, middle, last], axis=1)
