"""What each method reads of a motion: a place, and a coordinate of the self-motion.

- ``paper``: hand position, joint angles of the chain;
- ``proximal``: hand position; rotation vector of the upper arm about a reference, and
  elbow flexion. A turned hand moves neither pronation nor wrist into c;
- ``intent``: wrist center and the hand's direction; hinge swivel.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.motion.motion import Motion
from ikns.nullspace.hinge_swivel import arm_swivel, hand_direction

Method = Literal["paper", "proximal", "intent"]
METHODS: tuple[Method, ...] = ("paper", "proximal", "intent")

#: Step of the central difference, rad: its error is of the order of the step squared.
_STEP = 1e-5


def readout_samples(
    skeleton: Skeleton,
    motion: Motion,
    chain: ChainLike,
    method: Method,
    *,
    reference: Array | None = None,
) -> tuple[Array, Array]:
    """Place and coordinate of every frame.

    Parameters
    ----------
    skeleton : Skeleton
        Of the motion.
    motion : Motion
    chain : str
        See :class:`ikns.Chain`; of one arm for ``"intent"``.
    method : {"paper", "proximal", "intent"}
    reference : (S, 3, 3) array, optional
        For ``"proximal"``: a reference orientation of each upper arm of the chain in
        the thorax.

    Returns
    -------
    x : (T, 3) array
        m in the thorax frame. Of ``"intent"`` (T, 6): the wrist, and the unit vector
        from wrist to knuckle; of a left arm mirrored to the right.
    y : (T, k) array
        rad; NaN, as `x`, where the chain is not in sight.
    """
    if method == "paper":
        return motion.task_position(chain), motion.chain_angles(chain)
    seen = motion.in_sight(chain)[:, None]
    angles = np.where(seen, motion.angles, np.nan)
    x, y = posture_samples(skeleton, angles, chain, method, reference=reference)
    if method == "proximal":
        return motion.task_position(chain), y
    return np.where(seen, x, np.nan), np.where(seen, y, np.nan)


def posture_samples(
    skeleton: Skeleton,
    angles: Array,
    chain: ChainLike,
    method: Method,
    *,
    reference: Array | None = None,
) -> tuple[Array, Array]:
    """Place and coordinate of postures (T, 18), as of :func:`readout_samples`."""
    if method == "intent":
        wrist, swivel = arm_swivel(skeleton, angles, chain)
        direction = hand_direction(skeleton, angles, chain)
        return np.hstack([wrist, direction]), swivel[:, None]
    hand = skeleton.chain_ends(angles, chain)[0].mean(axis=1)
    if method == "paper":
        return hand, angles[:, [*map(skeleton.joint_names.index, chain_joints(chain))]]
    if method != "proximal" or reference is None:
        raise InvalidInput(
            f"expected a method of {', '.join(METHODS)}, and a reference for proximal; "
            f"found '{method}'."
        )
    columns = []
    for side, start in zip(chain_sides(chain), reference, strict=True):
        turned = skeleton.link_in_thorax(angles, f"{side}_upper_arm")[1]
        flexion = skeleton.joint_names.index(f"{side}_elbow_flexion")
        columns += [rotation_vector(turned, start), angles[:, [flexion]]]
    return hand, np.hstack(columns)


def rotation_vector(upper_arm_in_thorax: Array, reference: Array) -> Array:
    """Vectors y of rotations ``R = reference exp(y)``, (..., 3) rad; NaN for NaN."""
    from scipy.spatial.transform import Rotation

    flat = upper_arm_in_thorax.reshape(-1, 3, 3)
    y = np.full((len(flat), 3), np.nan)
    known = np.isfinite(flat).all(axis=(1, 2))
    if known.any():
        y[known] = Rotation.from_matrix(reference.T @ flat[known]).as_rotvec()
    return y.reshape(*upper_arm_in_thorax.shape[:-2], 3)


def mean_orientation(skeleton: Skeleton, angles: Array, chain: ChainLike) -> Array:
    """Mean orientation of each upper arm of a chain, (S, 3, 3), over postures (T, 18).

    Rotation vectors about it are shortest, and farthest from their end at pi.
    """
    from scipy.spatial.transform import Rotation

    means = []
    for side in chain_sides(chain):
        turned = skeleton.link_in_thorax(angles, f"{side}_upper_arm")[1]
        known = np.isfinite(turned).all(axis=(1, 2))
        means.append(Rotation.from_matrix(turned[known]).mean().as_matrix())
    return np.array(means)


def elbow_height_gradient(reference: Array) -> Array:
    """Gradient of the elbows' heights over proximal coordinates, (1, 4 S).

    At the reference orientations (S, 3, 3), per length of the upper arm; both elbows
    are summed. c increases with it.
    """
    from scipy.spatial.transform import Rotation

    rows = []
    for start in reference:
        for step in np.eye(3) * _STEP:
            up, down = (
                (start @ Rotation.from_rotvec(sign * step).as_matrix())[1, 1]
                for sign in (1.0, -1.0)
            )
            # The elbow is at -Y of the upper arm.
            rows.append(-(up - down) / (2 * _STEP))
        rows.append(0.0)
    return np.array(rows)[None]
