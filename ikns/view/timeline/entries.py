"""What one frame shows, as plain arrays; the world frame, meters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.view.body import arm_points


class Points(NamedTuple):
    """Named points, (n, 3) m."""

    places: Array
    names: tuple[str, ...]


class Lines(NamedTuple):
    """Polylines, each (n, 3) m; an array where all have as many points."""

    strips: tuple[Array, ...] | Array


Entry = Points | Lines | float


def frame_entries(
    skeleton: Skeleton,
    labels: Sequence[str],
    markers: Array,
    q: Array,
    numbers: Mapping[str, float],
) -> dict[str, Entry]:
    """Return what a frame shows, by path.

    Parameters
    ----------
    skeleton : Skeleton
    labels : sequence of str
        Of the markers.
    markers : (M, 3) array
        m in the world; those not seen (NaN) are left out.
    q : (25,) array
        Configuration; NaN where there is no pose to believe.
    numbers : mapping
        Values by path; NaN are left out, so that no old one stands for them.

    Returns
    -------
    dict
        ``world/markers``, ``world/arms``, ``world/residuals`` (from each seen marker to
        where the pose has it), and the numbers.

    Examples
    --------
    >>> body = Skeleton.load()
    >>> q = body.neutral()
    >>> there = body.markers_in_world(q)
    >>> shown = frame_entries(body, body.marker_set.labels, there, q, {"signal/c": 0.5})
    >>> list(shown)
    ['world/markers', 'world/arms', 'world/residuals', 'signal/c']
    """
    seen = np.flatnonzero(np.isfinite(markers).all(axis=1))
    names = tuple(labels[k] for k in seen.tolist())
    shown: dict[str, Entry] = {"world/markers": Points(markers[seen], names)}
    if np.isfinite(q).all():
        placed = skeleton.markers_in_world(q)
        shown["world/arms"] = Lines(_arms(skeleton, q))
        pairs = np.stack([markers[seen], placed[seen]], axis=1)
        shown["world/residuals"] = Lines(pairs)
    else:  # what was drawn before must not stay
        shown["world/arms"] = shown["world/residuals"] = Lines(())
    shown |= {path: v for path, v in numbers.items() if math.isfinite(v)}
    return shown


def _arms(skeleton: Skeleton, q: Array) -> tuple[Array, ...]:
    """Both arms from shoulder to knuckle, and the line between the shoulders."""
    turn = Rotation.from_quat(q[3:7])
    right, left = (turn.apply(arm) + q[:3] for arm in arm_points(skeleton, q))
    return right, left, np.array([right[0], left[0]])
