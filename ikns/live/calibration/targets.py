"""Where the hand should go next, in words, and how far it still is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.body.chains import SIDES, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.clustering import (
    BoundingBox,
    box_surface_points,
    minimum_bounding_box,
)

__all__ = ["TargetPoints", "HandTracker", "direction_in_words", "target_points"]

Array = NDArray[np.float64]

#: A part of the way shorter than this share of the longest part is not worth a word.
_WORTH_SAYING = 0.3
#: Each way along the axes of the thorax (ISB): X forward, Y up, Z right.
_WAYS = (("forward", "back"), ("up", "down"), ("to the right", "to the left"))
_ORDER = (1, 0, 2)


def direction_in_words(way: ArrayLike) -> str:
    """Say a way in the thorax frame as the person would.

    Examples
    --------
    >>> direction_in_words([0.2, 0.3, 0.15]), direction_in_words([0.01, -0.2, 0.0])
    ('up, forward, to the right', 'down')
    """
    parts = np.asarray(way, dtype=np.float64)
    longest = np.abs(parts).max()
    said = [
        _WAYS[axis][int(parts[axis] < 0)]
        for axis in _ORDER
        if abs(parts[axis]) > _WORTH_SAYING * longest
    ]
    return ", ".join(said) or "stay"


def target_points(explored: ArrayLike, box: BoundingBox, n: int) -> Array:
    """Places that the hand reached, each nearest to a place on the box around all.

    The box is that of minimum volume; its vertices come first, then the centers of its
    upper and lower face (Lisini Baldi et al., arXiv 2012.03600). A box around what a
    hand can reach has corners that it cannot.

    Parameters
    ----------
    explored : (N, 3) array
        Hand positions in the thorax frame, m.
    box : BoundingBox
        Around them.
    n : int
        How many places.

    Returns
    -------
    (n, 3) array
    """
    places = np.asarray(explored, dtype=np.float64)
    wanted = box_surface_points(box, n)
    nearest = [int(np.argmin(((places - w) ** 2).sum(axis=1))) for w in wanted]
    return places[nearest]


class HandTracker:
    """Where the hand is, frame by frame, as the line of calibration sees it.

    Parameters
    ----------
    skeleton : Skeleton
        The person's.
    chain : str
        See :data:`ikns.body.chains.CHAINS`.
    labels : sequence of str
        Of the frames' markers.
    """

    def __init__(self, skeleton: Skeleton, chain: str, labels: Sequence[str]) -> None:
        self._skeleton, self._labels = skeleton, tuple(labels)
        self._sides = [SIDES.index(side) for side in chain_sides(chain)]
        self._solver = MarkerIK(skeleton)
        self._q: Array | None = None

    def place(self, markers: Array) -> Array | None:
        """Hand, or the middle of both, in the thorax frame, (3,) m; None if unseen."""
        worn = self._skeleton.marker_set
        pose = self._solver.solve(worn.pick(self._labels, markers), self._q)
        if not math.isfinite(pose.residual):
            return None
        self._q = pose.q
        hands = self._skeleton.hands_in_thorax(pose.q)[0]
        return np.asarray(hands[self._sides].mean(axis=0))


class TargetPoints:
    """Suggest a place for each point.

    Parameters
    ----------
    explored : (N, 3) array
        Hand positions of the free exploration, thorax frame, m.
    n_points : int
    """

    def __init__(self, explored: Array, n_points: int) -> None:
        box = minimum_bounding_box(explored)
        self.places = target_points(explored, box, n_points)
        self._middle = box.center

    def words(self, point: int) -> str:
        """Where point number `point` (from 0) is, seen from the middle of the box."""
        return direction_in_words(self.places[point] - self._middle)
