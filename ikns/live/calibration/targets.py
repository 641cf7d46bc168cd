"""Target points for the hand, and directions in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.nullspace.clustering import (
    BoundingBox,
    box_surface_points,
    minimum_bounding_box,
)

#: Components smaller than this share of the largest one are not mentioned.
_LEAST_SHARE = 0.3
#: Directions along the axes of the thorax (ISB): X forward, Y up, Z right.
_DIRECTIONS = (("forward", "back"), ("up", "down"), ("to the right", "to the left"))
_ORDER = (1, 0, 2)


def direction_in_words(displacement: ArrayLike) -> str:
    """Describe a displacement in the thorax frame from the person's point of view.

    Examples
    --------
    >>> direction_in_words([0.2, 0.3, 0.15]), direction_in_words([0.01, -0.2, 0.0])
    ('up, forward, to the right', 'down')
    """
    parts = np.asarray(displacement, dtype=np.float64)
    longest = np.abs(parts).max()
    words = [
        _DIRECTIONS[axis][int(parts[axis] < 0)]
        for axis in _ORDER
        if abs(parts[axis]) > _LEAST_SHARE * longest
    ]
    return ", ".join(words) or "stay"


def target_points(explored: ArrayLike, box: BoundingBox, n: int) -> Array:
    """Explored positions that are nearest to points on the surface of a box.

    The points on the box are its vertices, then the centers of its upper and lower face
    (Lisini Baldi et al., arXiv 2012.03600). As the hand cannot reach every corner of a
    box around its workspace, the nearest explored positions are used. One or two points
    are the centers: corners are the places that ordinary movement teaches least.

    Parameters
    ----------
    explored : (N, 3) array
        Hand positions in the thorax frame, m.
    box : BoundingBox
        Minimum bounding box of `explored`.
    n : int
        Number of points.

    Returns
    -------
    (n, 3) array
    """
    places = np.asarray(explored, dtype=np.float64)
    wanted = (
        box_surface_points(box, n) if n > 2 else box_surface_points(box, 10)[8:][:n]
    )
    nearest = [int(np.argmin(((places - w) ** 2).sum(axis=1))) for w in wanted]
    return places[nearest]


class TargetPoints:
    """Suggested positions for the points of the protocol.

    Parameters
    ----------
    explored : (N, 3) array
        Hand positions of the free exploration, thorax frame, m.
    n_points : int

    Attributes
    ----------
    positions : (n_points, 3) array
        Thorax frame, m.
    """

    def __init__(self, explored: Array, n_points: int) -> None:
        box = minimum_bounding_box(explored)
        self.positions = target_points(explored, box, n_points)
        self._center = box.center

    def direction(self, point: int) -> str:
        """Direction of a point (number from 0) from the center of the box, in words."""
        return direction_in_words(self.positions[point] - self._center)
