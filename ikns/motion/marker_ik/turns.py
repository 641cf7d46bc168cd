"""Clusters of markers with a free turn: which there are, and where a pose has them."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.skeleton import Skeleton
from ikns.numerics.rigid import quaternion_matrix, turn_matrix


def turning_clusters(skeleton: Skeleton) -> tuple[Indices, Indices]:
    """Joints (K,) that clusters of markers turn about freely; cluster of each marker.

    The latter is (M,), -1 for markers that follow their joint.
    """
    joint, _ = skeleton.tree_markers
    worn = skeleton.marker_set.markers
    free = np.array([marker.free_turn for marker in worn], dtype=bool)
    joints = np.unique(joint[free]).astype(np.int64)
    cluster = np.searchsorted(joints, joint)
    return joints, np.where(free, cluster, -1).astype(np.int64)


def turned_markers(skeleton: Skeleton, q: Array, seen: Array) -> Array:
    """Where poses have the markers, (..., M, 3) m in the world.

    As :meth:`Skeleton.markers_in_world`, with every cluster of a free turn turned to
    where its markers were seen, as marker inverse kinematics has it.

    Parameters
    ----------
    skeleton : Skeleton
    q : (..., 25) array
    seen : (..., M, 3) array
        m in the world, in the order of the skeleton's marker set; NaN = not seen.

    Examples
    --------
    >>> body = Skeleton.load(marker_set="ue_adl")
    >>> q = body.neutral()
    >>> markers = body.markers_in_world(q)
    >>> bool(np.allclose(turned_markers(body, q, markers), markers))
    True
    """
    placed = skeleton.markers_in_world(q)
    joints, cluster = turning_clusters(skeleton)
    if len(joints):
        for at in np.ndindex(q.shape[:-1]):
            for k in range(len(joints)):
                _turn(placed[at], skeleton, q[at], seen[at], cluster == k)
    return placed


def _turn(placed: Array, skeleton: Skeleton, q: Array, seen: Array, own: Mask) -> None:
    """Turn the `own` ones of markers placed (M, 3) at one pose to where they were seen.

    In place.
    """
    worn = skeleton.marker_set.markers
    link = worn[int(np.flatnonzero(own)[0])].link
    origin, turned = skeleton.link_in_thorax(q, link)
    thorax = quaternion_matrix(q[3:7])
    # Joints of the tree turn about their z.
    axis = thorax @ turned @ skeleton.tree_link(link)[1][2]
    origin = thorax @ origin + q[:3]
    trust = np.array([0.0 if m.static_only else m.weight for m in worn])
    used = own & np.isfinite(seen).all(axis=1) & (trust > 0)
    p, s = placed[used] - origin, seen[used] - origin
    across = trust[used] @ (np.cross(p, s) @ axis)
    along = trust[used] @ (np.sum(p * s, axis=1) - (p @ axis) * (s @ axis))
    turn = turn_matrix(axis, np.arctan2(across, along))
    placed[own] = (placed[own] - origin) @ turn.T + origin
