"""Rigid motions: the one that carries points onto points, and steps between poses."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array


def rigid_transform(source: Array, target: Array) -> tuple[Array, Array]:
    """Rotation (..., 3, 3) and shift (..., 3) that best map points to points.

    ``target ~ source @ rotation.T + shift``, points (..., N, 3) with N >= 3 (Kabsch
    1976).
    """
    a, b = source.mean(axis=-2), target.mean(axis=-2)
    across = np.swapaxes(target - b[..., None, :], -1, -2) @ (source - a[..., None, :])
    u, _, vt = np.linalg.svd(across)
    flip = np.zeros(u.shape)
    flip[..., 0, 0] = flip[..., 1, 1] = 1.0
    flip[..., 2, 2] = np.linalg.det(u) * np.linalg.det(vt)
    rotation = u @ flip @ vt
    return rotation, b - (rotation @ a[..., None])[..., 0]


def aligned(frames: Array, reference: Array) -> Array:
    """Move each frame of points (T, N, 3) as a rigid body onto a reference (N, 3).

    By the points that both have; NaN where a frame has fewer than three of them, or
    lacks the point.

    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> turned = square[None] @ turn_matrix(np.array([0.0, 0, 1]), 0.3) + [0, 0, 2]
    >>> bool(np.allclose(aligned(turned, square), square))
    True
    """
    moved = np.full(frames.shape, np.nan)
    both = np.isfinite(frames).all(axis=2) & np.isfinite(reference).all(axis=1)
    for common in np.unique(both, axis=0):
        if common.sum() >= 3:
            rows = np.flatnonzero((both == common).all(axis=1))
            own = frames[rows]
            turn, shift = rigid_transform(own[:, common], reference[common])
            moved[rows] = own @ np.swapaxes(turn, 1, 2) + shift[:, None]
    return moved


def quaternion_matrix(quaternion: Array) -> Array:
    """Rotations (..., 3, 3) of quaternions (..., 4), x, y, z, w, of any length but 0.

    >>> quaternion_matrix(np.array([0.0, 0.0, 2.0, 2.0])).round(9).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    x, y, z, w = np.moveaxis(quaternion / length, -1, 0)
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.moveaxis(rows, (0, 1), (-2, -1))


def turn_matrix(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) about a unit vector (3,) by an angle, rad (Rodrigues).

    >>> turn_matrix(np.array([0.0, 0.0, 1.0]), np.pi / 2).round(9).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    half = angle / 2
    return quaternion_matrix(np.append(np.sin(half) * axis, np.cos(half)))


def turn_to(axis: Array) -> Array:
    """Return a rotation (3, 3) whose z axis points along a vector (3,).

    >>> turn_to(np.array([0.0, -2.0, 0.0]))[:, 2].tolist()
    [0.0, -1.0, 0.0]
    """
    z = axis / np.linalg.norm(axis)
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x -= z * (x @ z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def pose_steps(poses: Array) -> Array:
    """Return the step from each pose to the next, as seen from the first of the two.

    The logarithm of the motion between them, ``log(T_0^-1 T_1)``: with the rotation
    vector w of an angle a and the shift p, its linear part is (Lynch and Park 2017,
    Modern Robotics, eq. 3.92) ::

        p - w x p / 2 + (1 - (a / 2) / tan(a / 2)) / a^2  w x (w x p)

    Poses (T, 7) are position (m) and unit quaternion x, y, z, w; steps (T - 1, 6) are
    linear (m) and angular (rad).
    """
    turns = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    v, s = -turns[:-1, :3], turns[:-1, 3:]  # of the turn back
    v1, s1 = turns[1:, :3], turns[1:, 3:]
    w = _rotation_vector(
        s * v1 + s1 * v + np.cross(v, v1),
        s * s1 - np.sum(v * v1, axis=1, keepdims=True),
    )
    moved = np.diff(poses[:, :3], axis=0)
    twice = 2 * np.cross(v, moved)
    p = moved + s * twice + np.cross(v, twice)
    half = np.linalg.norm(w, axis=1, keepdims=True) / 2
    # Below 1e-4 rad the next term of the series, a^2 / 720, is lost in rounding.
    small = half < 5e-5
    safe = np.where(small, 1.0, half)
    factor = np.where(small, 1 / 12, (1 - safe / np.tan(safe)) / (4 * safe**2))
    across = np.cross(w, p)
    return np.hstack([p - across / 2 + factor * np.cross(w, across), w])


def _rotation_vector(vector: Array, scalar: Array) -> Array:
    """Rotation vectors (N, 3), rad, of unit quaternions: vector (N, 3), scalar (N, 1).

    The shorter way around. SciPy's rotations do the same, and take longer to import
    than all else that turns markers into angles.
    """
    sine = np.linalg.norm(vector, axis=1, keepdims=True)
    half = np.arctan2(sine, np.abs(scalar))
    # Below 1e-4 rad the next term of half / sin(half), half^4 7 / 360, is rounding.
    small = half < 1e-4
    ratio = np.where(small, 1 + half**2 / 6, half / np.where(small, 1.0, sine))
    turns: Array = 2 * np.copysign(ratio, scalar) * vector
    return turns
