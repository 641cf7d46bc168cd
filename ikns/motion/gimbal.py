"""Rotations as three angles: without jumps, and where they say little (gimbal lock)."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import SIDES
from ikns.motion.motion import Motion
from ikns.numerics.rigid import quaternion_matrix

#: Where the cosine of the middle angle is less, an error of the rotation is more than
#: ten times as large in the other two angles: within 5.7 deg of +-90.
_LOCKED = 0.1
#: From here on the two have no single value at all.
_EXACTLY = 1e-9


def xyz_angles(rotations: Array) -> Array:
    """Angles about a body's own x, then y, then z, without jumps.

    Every rotation has two such triples besides full turns: (x, y, z) and
    (x + pi, pi - y, z + pi). Each frame takes the one that is nearer to the frame
    before, so a body that turns on and on has angles that go on, through gimbal lock
    too. The first frame has y from -pi/2 to pi/2. In exact gimbal lock x stays.

    Parameters
    ----------
    rotations : (T, 3, 3) array

    Returns
    -------
    (T, 3) array
        Radians.

    Examples
    --------
    >>> quarter = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    >>> np.degrees(xyz_angles(np.array([np.eye(3), quarter, quarter @ quarter])))[:, 1]
    array([  0.,  90., 180.])
    """
    R = np.asarray(rotations, dtype=np.float64)
    cosine = np.hypot(R[:, 0, 0], R[:, 0, 1])
    y = np.arctan2(R[:, 0, 2], cosine)
    x = np.arctan2(-R[:, 1, 2], R[:, 2, 2])
    z = np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    locked = cosine < _EXACTLY
    if locked.any():
        # The last frame that has an x; none before it has 0.
        last = np.maximum.accumulate(np.where(locked, -1, np.arange(len(x))))
        x = np.where(last >= 0, x[last], 0.0)
        both = np.arctan2(R[:, 1, 0], R[:, 1, 1])  # x + z, or z - x where y is -pi/2
        z = np.where(locked, both - np.sign(y) * x, z)
    first = np.stack([x, y, z], axis=1)
    second = np.stack([x + np.pi, np.pi - y, z + np.pi], axis=1)
    changes = _apart(first[:-1], second[1:]) < _apart(first[:-1], first[1:])
    other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])[: len(x)]
    return np.unwrap(np.where(other[:, None], second, first), axis=0)


def _apart(a: Array, b: Array) -> Array:
    """Distance of triples (T, 3) of angles, full turns left out, (T,) rad."""
    return np.asarray(np.linalg.norm((b - a + np.pi) % (2 * np.pi) - np.pi, axis=1))


def near_gimbal_lock(motion: Motion, *, thorax: bool) -> dict[tuple[str, str], int]:
    """Count the frames in which two angles cannot be told apart.

    Parameters
    ----------
    motion : Motion
    thorax : bool
        Whether the rotations of the thorax are given as angles too.

    Returns
    -------
    dict
        By the names of the two, for those that have such frames.
    """
    found: dict[tuple[str, str], Mask] = {}
    if thorax:
        turned = quaternion_matrix(motion.thorax_in_world[:, 3:])
        with np.errstate(invalid="ignore"):
            sine = np.abs(turned[:, 0, 2])  # of thorax_ry
            found["thorax_rx", "thorax_rz"] = sine > np.sqrt(1 - _LOCKED**2)
    angles = dict(zip(motion.joint_names, motion.angles.T, strict=True))
    for side in SIDES:
        # Abduction, flexion, rotation about x, z, y: an arm straight ahead.
        shoulder = f"{side}_shoulder"
        if (middle := angles.get(f"{shoulder}_flexion")) is not None:
            with np.errstate(invalid="ignore"):
                found[f"{shoulder}_abduction", f"{shoulder}_rotation"] = (
                    np.abs(np.cos(middle)) < _LOCKED
                )
    return {names: int(mask.sum()) for names, mask in found.items() if mask.any()}


def gimbal_sentence(motion: Motion, *, thorax: bool) -> str:
    """Say which angles cannot be told apart, and in how many frames; or nothing."""
    found = near_gimbal_lock(motion, thorax=thorax)
    if not found:
        return ""
    of = f" of {len(motion.time)}"
    parts = [f"{a} and {b} in {count}{of} frames" for (a, b), count in found.items()]
    return (
        f"near gimbal lock, where only the sum or difference of two angles is known: "
        f"{'; '.join(parts)}."
    )
