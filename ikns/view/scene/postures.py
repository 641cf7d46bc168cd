"""Postures to draw: one at a PCA point, ghosts along Z, and the sweep of the elbow.

Joint angles alone, (18,) or (N, 18) rad, everything seen from the thorax.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ikns.body.chains import SIDES, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import null_projector

__all__ = ["posture_at_point", "postures_along", "self_motion", "visited_posture"]

Array = NDArray[np.float64]

#: What an arm at rest on a table in front would take, rad.
_AT_EASE = {
    "shoulder_abduction": 0.35,
    "shoulder_flexion": 0.45,
    "shoulder_rotation": 0.35,
    "elbow_flexion": 1.4,
}
#: The hand counts as held within this, m and rad: invisible, and far above rounding.
HELD = 1e-9
#: A step along the self-motion, rad: drawn 120 times in a full turn of one joint.
_STEP = 0.05
#: Newton steps allowed: from an error of `_STEP`^2 each squares it, so 3 or 4 do.
_CORRECTIONS = 12
_MOST_STEPS = 200


def posture_at_point(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: str,
    point: int,
    *,
    start: ArrayLike | None = None,
) -> Array:
    """Posture near rest with the hand at a PCA point, in the middle of its range.

    A subject folder says where the hand was and between which ends ``Z @ q`` moved, but
    not the postures. Of all postures with the hand there and ``Z @ q`` halfway, this is
    (to first order at each step) the nearest to `start`.

    Parameters
    ----------
    skeleton : Skeleton
    learned : NullSpaceMap
    chain : str
        Joints of the map.
    point : int
        Row of ``learned.centers_``.
    start : (25,) or (18,) array, optional
        Default: arms at ease, elbows bent.

    Returns
    -------
    (18,) array
        As near to the point as joint limits allow.
    """
    rest = _at_ease(skeleton) if start is None else _angles(skeleton, start)
    columns = _columns(skeleton, chain)
    sides = [SIDES.index(side) for side in chain_sides(chain)]
    z, center = learned.directions_[point], learned.centers_[point]
    middle = (learned.lower_[point] + learned.upper_[point]) / 2
    q = rest.copy()
    for _ in range(60):
        place = skeleton.hands_in_thorax(q)[0][sides].mean(axis=0)
        J = skeleton.chain_jacobian(q, chain, task="position")
        A = np.vstack([J.reshape(len(sides), 3, -1).mean(axis=0), z])
        error = np.concatenate([center - place, middle - z @ q[columns]])
        home = (rest - q)[columns]
        step = home + np.linalg.pinv(A, rcond=1e-3) @ (error - A @ home)
        step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-12))
        q[columns] = np.clip(
            q[columns] + step, skeleton.lower[columns], skeleton.upper[columns]
        )
        if np.abs(step).max() < 1e-8:
            break
    return q


def visited_posture(
    skeleton: Skeleton, learned: NullSpaceMap, chain: str, point: int
) -> Array | None:
    """Mean posture at a PCA point, (18,) rad; None for a map that does not know it.

    Only a map that was fitted does, not one from a file.
    """
    if not hasattr(learned, "cluster_means_"):
        return None
    q = _at_ease(skeleton)
    q[_columns(skeleton, chain)] = learned.cluster_means_[point]
    return q


def postures_along(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: str,
    point: int,
    q: Array,
    c: Array,
) -> Array:
    """Postures straight along Z through `q`, where the point's own signal is `c`.

    Parameters
    ----------
    skeleton, learned, chain, point
        As :func:`posture_at_point` takes them.
    q : (18,) array
        Posture, rad.
    c : (N,) array
        0 at m and 1 at M.

    Returns
    -------
    (N, 18) array
        ``q + s Z``; with a Z that is not quite a null direction the hand strays.
    """
    columns = _columns(skeleton, chain)
    z = learned.directions_[point, 0]
    lower, upper = learned.lower_[point, 0], learned.upper_[point, 0]
    s = lower + np.asarray(c) * (upper - lower) - z @ q[columns]
    postures = np.tile(q, (len(s), 1))
    # Rows of Z are orthonormal, so Z @ q rises by s.
    postures[:, columns] += s[:, None] * z
    return postures


def self_motion(
    skeleton: Skeleton, learned: NullSpaceMap, chain: str, point: int, q: Array
) -> Array:
    """Postures through `q` that hold the hands' pose: the elbow swivels.

    Each step goes along the Jacobian's null space (what of Z lies in it, where it has
    several dimensions) and is then corrected until the hand is back.

    Parameters
    ----------
    skeleton, learned, chain, point
        As :func:`posture_at_point` takes them; Z gives the sense, m and M the ends.
    q : (18,) array
        Posture to start from, rad.

    Returns
    -------
    (N, 18) array
        From the end where ``Z @ q`` is m to that where it is M, or where a joint limit
        or a straight arm stops it; `q` is one of them, and the only one where nothing
        can move.
    """
    z = learned.directions_[point, 0]
    ends = learned.lower_[point, 0], learned.upper_[point, 0]
    back = _swept(skeleton, chain, q, -z, -ends[0])
    on = _swept(skeleton, chain, q, z, ends[1])
    return np.array([*back[::-1], q, *on])


def _swept(
    skeleton: Skeleton, chain: str, q: Array, z: Array, end: float
) -> list[Array]:
    """Postures after `q` while ``z @ q`` rises to `end`."""
    columns = _columns(skeleton, chain)
    low, high = skeleton.lower[columns], skeleton.upper[columns]
    target = _hands(skeleton, chain, q)
    found: list[Array] = []
    heading = z
    while len(found) < _MOST_STEPS:
        here = found[-1] if found else q
        left = end - float(z @ here[columns])
        tangent = null_projector(_jacobian(skeleton, chain, here)) @ heading
        length = float(np.linalg.norm(tangent))
        # 1e-6: nothing of the direction is left in the null space.
        if left <= 0 or length < 1e-6:
            break
        heading = tangent / length
        rate = float(z @ heading)
        step = min(_STEP, left / rate) if rate > 1e-3 else _STEP
        following = here.copy()
        following[columns] += step * heading
        corrected = _held(skeleton, chain, following, target)
        if (
            corrected is None
            or not ((corrected[columns] >= low) & (corrected[columns] <= high)).all()
        ):
            break
        found.append(corrected)
        if step < _STEP:
            break
    return found


def _held(
    skeleton: Skeleton, chain: str, q: Array, target: tuple[Array, Array]
) -> Array | None:
    """Posture near `q` with the hands at their target, or None where Newton fails."""
    columns = _columns(skeleton, chain)
    q = q.copy()
    for _ in range(_CORRECTIONS):
        error = _off(_hands(skeleton, chain, q), target)
        if np.abs(error).max() < HELD:
            return q
        q[columns] += np.linalg.pinv(_jacobian(skeleton, chain, q)) @ error
    return None


def _off(hands: tuple[Array, Array], target: tuple[Array, Array]) -> Array:
    """Way to the target, (6 sides,): m, then rotation vector in rad, side by side."""
    turn = target[1] @ np.swapaxes(hands[1], -1, -2)
    rotation = Rotation.from_matrix(turn).as_rotvec()
    return np.concatenate([target[0] - hands[0], rotation], axis=1).ravel()


def _hands(skeleton: Skeleton, chain: str, q: Array) -> tuple[Array, Array]:
    sides = [SIDES.index(side) for side in chain_sides(chain)]
    place, rotation = skeleton.hands_in_thorax(q)
    return place[sides], rotation[sides]


def _jacobian(skeleton: Skeleton, chain: str, q: Array) -> Array:
    return skeleton.chain_jacobian(q, chain, task="pose")


def _columns(skeleton: Skeleton, chain: str) -> list[int]:
    return [skeleton.joint_names.index(joint) for joint in chain_joints(chain)]


def _angles(skeleton: Skeleton, q: ArrayLike) -> Array:
    return np.array(q, dtype=np.float64)[-len(skeleton.joint_names) :]


def _at_ease(skeleton: Skeleton) -> Array:
    named = {f"{side}_{joint}": x for side in SIDES for joint, x in _AT_EASE.items()}
    return np.array([named.get(joint, 0.0) for joint in skeleton.joint_names])
