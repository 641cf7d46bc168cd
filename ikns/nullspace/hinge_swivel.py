"""How far the elbow is turned about the line from shoulder to wrist, by its hinge.

The swivel of joint centers is wrong near a straight arm, where the carrying angle and
not the hinge decides where the elbow's center lies. The hinge axis itself tells the
same angle at any flexion: it is normal to the plane in which the elbow bends.

Zero is not "down", whose projection turns fast where the arm hangs, but a reference
carried along by the least rotation. So s is smooth wherever a hand goes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import ChainLike, no_swivel, whole_arms
from ikns.errors import InvalidInput
from ikns.numerics.cross_product import cross

if TYPE_CHECKING:
    from ikns.body.skeleton import Skeleton

#: Where the reference starts: 10 deg below forward and 20 deg outward of a right arm,
#: about the middle of a table's work space (ISB thorax: X forward, Y up, Z right).
#: Opposite to it, behind and above the shoulder, the swivel is undefined.
FORWARD = np.array([0.925, -0.174, 0.337]) / np.linalg.norm([0.925, -0.174, 0.337])
#: The reference there: the downward direction normal to it.
DOWN = np.array([0.0, -1.0, 0.0]) + FORWARD[1] * FORWARD
DOWN /= np.linalg.norm(DOWN)
#: Sines below this are rounding: the hand behind, or on the hinge's own axis.
_DEGENERATE = 1e-9


def hinge_swivel(
    shoulder_in_thorax: ArrayLike,
    wrist_in_thorax: ArrayLike,
    hinge_axis_in_thorax: ArrayLike,
    *,
    side: str = "right",
) -> Array:
    """Angle s of the elbow about the line from shoulder to wrist, by the hinge axis.

    With n the direction from shoulder p to wrist w and z the hinge axis, the elbow
    points to ``e = -unit(z x n)``. The reference u is the downward direction normal to
    :data:`FORWARD`, f, carried by the least rotation of f to n; then
    ``s = atan2(e . (-n x u), e . u)``.

    Along the self-motion of a held wrist s changes as much as the arm turns; pronation
    and wrist joints do not move it at all.

    Parameters
    ----------
    shoulder_in_thorax, wrist_in_thorax : (..., 3) arrays
        Glenohumeral and wrist center in the thorax frame, m.
    hinge_axis_in_thorax : (..., 3) array
        Axis about which the elbow flexes, positive by the right-hand rule; to the right
        while the arms hang, on both sides. Any length.
    side : {"right", "left"}
        A left arm is mirrored in the sagittal plane first.

    Returns
    -------
    (...) array
        Radians in (-pi, pi]; larger with the elbow lifted outward. NaN where an input
        is not finite, and where the angle is undefined.

    Raises
    ------
    InvalidInput
        When a shape or the side is invalid.

    Examples
    --------
    >>> hand_ahead = hinge_swivel([0, 0, 0.2], [0.4, 0, 0.2], [0, 0, 1])
    >>> lifted = hinge_swivel([0, 0, 0.2], [0.4, 0, 0.2], [0, 1, 0])
    >>> round(float(np.degrees(lifted - hand_ahead)), 6)
    90.0
    """
    if side not in ("right", "left"):
        raise InvalidInput(f"expected the side 'right' or 'left', found '{side}'.")
    p, w, z = (
        np.asarray(rows, dtype=np.float64)
        for rows in (shoulder_in_thorax, wrist_in_thorax, hinge_axis_in_thorax)
    )
    if any(rows.ndim == 0 or rows.shape[-1] != 3 for rows in (p, w, z)):
        raise InvalidInput(
            f"expected shoulders, wrists and axes (..., 3), found {p.shape}, {w.shape} "
            f"and {z.shape}."
        )
    p, w, z = mirrored(p, side), mirrored(w, side), mirrored_axis(z, side)
    with np.errstate(invalid="ignore", divide="ignore"):
        n = (w - p) / np.linalg.norm(w - p, axis=-1, keepdims=True)
        z = z / np.linalg.norm(z, axis=-1, keepdims=True)
        elbow = -cross(z, n)
        k = cross(FORWARD, n)
        behind = 1.0 + n @ FORWARD
        kd = cross(k, DOWN)
        u = DOWN + kd + cross(k, kd) / behind[..., None]
        s = np.arctan2((elbow * cross(-n, u)).sum(axis=-1), (elbow * u).sum(axis=-1))
    bad = np.linalg.norm(elbow, axis=-1) < _DEGENERATE
    return np.asarray(np.where(bad | ~(behind > _DEGENERATE), np.nan, s))


def mirrored(points_in_thorax: Array, side: str) -> Array:
    """Points (..., 3) of a left arm as those of a right one."""
    return points_in_thorax * [1.0, 1.0, -1.0] if side == "left" else points_in_thorax


def mirrored_axis(axis_in_thorax: Array, side: str) -> Array:
    """Axis of rotation (..., 3) of a left arm as that of a right one."""
    return axis_in_thorax * [-1.0, -1.0, 1.0] if side == "left" else axis_in_thorax


def arm_swivel(
    skeleton: Skeleton, q: ArrayLike, chain: ChainLike
) -> tuple[Array, Array]:
    """Wrist center and hinge swivel of a chain with one arm.

    Parameters
    ----------
    skeleton : Skeleton
    q : (..., 25) or (..., 18) array
        Configurations, or joint angles alone; rad.
    chain : str
        See :class:`ikns.Chain`.

    Returns
    -------
    wrist : (..., 3) array
        In the thorax frame, m; of a left arm mirrored to the right.
    swivel : (...) array
        Radians; NaN where `q` holds NaN that matters.

    Raises
    ------
    InvalidInput
        When the chain is not one whole arm.
    """
    if reason := no_swivel(chain):
        raise InvalidInput(reason)
    (side,) = whole_arms(chain)
    shoulder, rotation = skeleton.link_in_thorax(q, f"{side}_upper_arm")
    wrist, _ = skeleton.link_in_thorax(q, f"{side}_hand")
    swivel = hinge_swivel(shoulder, wrist, rotation[..., :, 2], side=side)
    return mirrored(wrist, side), swivel


def hand_direction(skeleton: Skeleton, q: ArrayLike, chain: ChainLike) -> Array:
    """Return unit vectors from wrist to knuckle of a chain with one arm, (..., 3).

    In the thorax frame, of a left arm mirrored to the right; `q` and `Raises` as of
    :func:`arm_swivel`.
    """
    if reason := no_swivel(chain):
        raise InvalidInput(reason)
    (side,) = whole_arms(chain)
    wrist = skeleton.link_in_thorax(q, f"{side}_hand")[0]
    way = skeleton.link_in_thorax(q, f"{side}_knuckle")[0] - wrist
    return mirrored(way / np.linalg.norm(way, axis=-1, keepdims=True), side)
