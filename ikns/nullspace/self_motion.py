"""Postures at a PCA point of a map: along its direction Z, and with the hand held.

Postures are joint angles alone, (18,) or (N, 18) rad; hands are seen from the thorax.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import null_projector

#: An arm resting on a table in front, rad.
_REST = {
    "shoulder_abduction": 0.35,
    "shoulder_flexion": 0.45,
    "shoulder_rotation": 0.35,
    "elbow_flexion": 1.4,
}
#: The hand counts as held within this, m and rad: far above rounding, far below what
#: anyone could see.
HOLD_TOLERANCE = 1e-9
#: Step along the self-motion, rad: some 120 in a full turn of one joint.
_STEP = 0.05
#: Newton steps allowed: from an error of `_STEP`^2 each squares it, so 3 or 4 do.
_CORRECTIONS = 12
_MOST_STEPS = 200


def posture_at_point(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: ChainLike,
    point: int,
    *,
    start: ArrayLike | None = None,
) -> Array:
    """Posture near rest with the hand at a PCA point, in the middle of its range.

    A subject folder holds the hand positions and the range of ``Z @ q``, but not the
    postures. Of all postures with the hand at row `point` of ``learned.centers_`` and
    ``Z @ q`` halfway, this is (to first order at each step) the nearest to `start`
    (25,) or (18,), by default arms at rest with elbows bent; as near as joint limits
    allow.
    """
    rest = _rest_posture(skeleton)
    if start is not None:
        rest = np.array(start, dtype=np.float64)[-len(rest) :]
    columns = _columns(skeleton, chain)
    z, center = learned.directions_[point], learned.centers_[point]
    middle = (learned.lower_[point] + learned.upper_[point]) / 2
    q = rest.copy()
    for _ in range(60):
        place = skeleton.chain_ends(q, chain)[0].mean(axis=0)
        J = skeleton.chain_jacobian(q, chain, task="position")
        A = np.vstack([J.reshape(-1, 3, len(columns)).mean(axis=0), z])
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
    skeleton: Skeleton, learned: NullSpaceMap, chain: ChainLike, point: int
) -> Array | None:
    """Mean posture at a PCA point, (18,) rad; None for a map that was not fitted.

    A map from a file does not hold postures.
    """
    if not hasattr(learned, "cluster_means_"):
        return None
    q = _rest_posture(skeleton)
    q[_columns(skeleton, chain)] = learned.cluster_means_[point]
    return q


def postures_along(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: ChainLike,
    point: int,
    q: Array,
    c: Array,
) -> Array:
    """Postures straight along Z through `q` at which the point's control signal is `c`.

    The control signal (N,) is 0 at m and 1 at M. The result (N, 18) is ``q + s Z``; the
    hand moves as far as Z is not a null direction.
    """
    columns = _columns(skeleton, chain)
    z = learned.directions_[point, 0]
    lower, upper = learned.lower_[point, 0], learned.upper_[point, 0]
    s = lower + np.asarray(c) * (upper - lower) - z @ q[columns]
    postures = np.tile(q, (len(s), 1))
    # A row of Z has unit length, so its own output rises by s.
    postures[:, columns] += s[:, None] * z
    return postures


def self_motion(
    skeleton: Skeleton, learned: NullSpaceMap, chain: ChainLike, point: int, q: Array
) -> Array:
    """Self-motion through `q`: postures that hold the pose of the hands, (N, 18).

    Each step goes along the Jacobian's null space (along the projection of Z, where it
    has several dimensions) and is then corrected by Newton's method, from ``Z @ q = m``
    to ``Z @ q = M``, or to where a joint limit or a straight arm stops it. `q` is one
    of the postures, and the only one if nothing can move.
    """
    z = learned.directions_[point, 0]
    ends = learned.lower_[point, 0], learned.upper_[point, 0]
    before = _sweep(skeleton, chain, q, -z, -ends[0])
    after = _sweep(skeleton, chain, q, z, ends[1])
    return np.array([*before[::-1], q, *after])


def _sweep(
    skeleton: Skeleton, chain: ChainLike, q: Array, z: Array, end: float
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
        # 1e-6: the direction has no part in the null space.
        if left <= 0 or length < 1e-6:
            break
        heading = tangent / length
        rate = float(z @ heading)
        step = min(_STEP, left / rate) if rate > 1e-3 else _STEP
        following = here.copy()
        following[columns] += step * heading
        corrected = _corrected(skeleton, chain, following, target)
        if (
            corrected is None
            or not ((corrected[columns] >= low) & (corrected[columns] <= high)).all()
        ):
            break
        found.append(corrected)
        if step < _STEP:
            break
    return found


def _corrected(
    skeleton: Skeleton, chain: ChainLike, q: Array, target: tuple[Array, Array]
) -> Array | None:
    """Posture near `q` with the hands at their target, or None where Newton fails."""
    columns = _columns(skeleton, chain)
    q = q.copy()
    for _ in range(_CORRECTIONS):
        error = _pose_error(_hands(skeleton, chain, q), target)
        if np.abs(error).max() < HOLD_TOLERANCE:
            return q
        q[columns] += np.linalg.pinv(_jacobian(skeleton, chain, q)) @ error
    return None


def _pose_error(hands: tuple[Array, Array], target: tuple[Array, Array]) -> Array:
    """Error to the target, (6 sides,): m, then a rotation vector in rad, by side."""
    from scipy.spatial.transform import Rotation

    turn = target[1] @ np.swapaxes(hands[1], -1, -2)
    rotation = Rotation.from_matrix(turn).as_rotvec()
    return np.concatenate([target[0] - hands[0], rotation], axis=1).ravel()


def _hands(skeleton: Skeleton, chain: ChainLike, q: Array) -> tuple[Array, Array]:
    return skeleton.chain_ends(q, chain)


def _jacobian(skeleton: Skeleton, chain: ChainLike, q: Array) -> Array:
    return skeleton.chain_jacobian(q, chain, task="pose")


def _columns(skeleton: Skeleton, chain: ChainLike) -> list[int]:
    return [skeleton.joint_names.index(joint) for joint in chain_joints(chain)]


def _rest_posture(skeleton: Skeleton) -> Array:
    named = {f"{side}_{joint}": x for side in SIDES for joint, x in _REST.items()}
    return np.array([named.get(joint, 0.0) for joint in skeleton.joint_names])
