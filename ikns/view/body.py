"""A plain body to draw behind data: arms of the skeleton, a trunk for orientation.

All coordinates are meters in the thorax frame: X forward, Y up, Z right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput

# Girth of the drawing as fractions of the shoulder-to-shoulder distance, read off the
# shapes of urdf/upper_body.urdf. Nothing is computed from it.
_ARM_RADII = (0.115, 0.095, 0.07, 0.05)
_TRUNK_PROFILE = (  # height under the shoulders, half width, half depth
    (-1.35, 0.44, 0.29),
    (-1.10, 0.39, 0.28),
    (-0.80, 0.37, 0.28),
    (-0.40, 0.42, 0.31),
    (-0.10, 0.43, 0.26),
    (0.03, 0.36, 0.20),
    (0.10, 0.13, 0.12),
)
_NECK = (0.13, 0.34)  # radius, height above the shoulders
_HEAD = (0.60, 0.25, 0.32)  # height of the middle, half width, half height


def arm_points(skeleton: Skeleton, q: ArrayLike) -> Array:
    """Shoulder, elbow, wrist and knuckle of both arms, (2, 4, 3) m.

    >>> arm_points(Skeleton.load(), Skeleton.load().neutral()).shape
    (2, 4, 3)
    """
    links = ("upper_arm", "forearm", "hand", "knuckle")
    pose = np.asarray(q, dtype=np.float64)
    return np.array(
        [
            [skeleton.link_in_thorax(pose, f"{side}_{link}")[0] for link in links]
            for side in SIDES
        ]
    )


def body_surfaces(arms: ArrayLike) -> list[Array]:
    """Surfaces of trunk, neck, head and :func:`arm_points`, as (u, v, 3) grids."""
    points = np.asarray(arms, dtype=np.float64)
    if points.shape != (2, 4, 3):
        raise InvalidInput(f"expected arms (2, 4, 3), found {points.shape}.")
    middle = points[:, 0].mean(axis=0)
    breadth = float(np.linalg.norm(points[0, 0] - points[1, 0]))
    radius, height = _NECK
    rise, half_width, half_height = _HEAD
    head = [
        (
            rise + half_height * np.sin(angle),
            half_width * np.cos(angle),
            half_width * np.cos(angle) * 1.15,
        )
        for angle in np.linspace(-np.pi / 2, np.pi / 2, 25)
    ]
    neck = [(0.0, radius, radius), (height, radius, radius)]
    surfaces = [
        _upright(middle, breadth, rings) for rings in (_TRUNK_PROFILE, neck, head)
    ]
    for arm in points:
        for k in range(3):
            ends = breadth * _ARM_RADII[k], breadth * _ARM_RADII[k + 1]
            surfaces.append(_tube(arm[k], arm[k + 1], *ends))
    return surfaces


def _upright(middle: Array, breadth: float, rings: ArrayLike) -> Array:
    """Stack elliptical rings (height, half width, half depth) around a vertical."""
    given = np.asarray(rings, dtype=np.float64)
    smooth = PchipInterpolator(np.arange(len(given)), given)
    fine = smooth(np.linspace(0, len(given) - 1, 36))
    height, width, depth = breadth * fine.T[:, :, None]
    around = np.linspace(2 * np.pi, 0, 49)
    ring = np.stack(
        [depth * np.cos(around), height + 0 * around, width * np.sin(around)], axis=-1
    )
    return np.asarray(middle + ring)


def _tube(start: Array, end: Array, first: float, last: float) -> Array:
    """Tube with round ends from `start` to `end`, radii `first` and `last`, m."""
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / max(length, 1e-9)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    around = np.linspace(2 * np.pi, 0, 33)
    circle = np.outer(np.cos(around), across) + np.outer(
        np.sin(around), np.cross(across, axis)
    )
    cap = np.linspace(0, np.pi / 2, 7)
    along = np.concatenate([-first * np.cos(cap), length + last * np.sin(cap)])
    radii = np.concatenate([first * np.sin(cap), last * np.cos(cap)])
    return np.asarray(
        start + along[:, None, None] * axis + radii[:, None, None] * circle
    )
