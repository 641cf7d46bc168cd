"""One simulated recording: the true motion, and the markers that cameras record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.artifacts import SoftTissue, occlusions
from ikns.simulation.wander import wander

#: Sway of the trunk on a chair, m and rad, standard deviations per axis: small, as the
#: protocol asks not to move the torso (assumption).
SEATED_SWAY = (2e-3, np.radians(0.3))
#: Cut-off of the trunk's sway, Hz: sway in quiet sitting and standing is mostly slower.
_SWAY_HZ = 0.3
#: Drift of joints that are meant to be still, rad, and its cut-off, Hz (assumption).
_STILL_SD, _STILL_HZ = np.radians(0.3), 0.3


@dataclass(frozen=True)
class Trial:
    """One simulated recording and the truth behind it, in the same frames.

    Parameters
    ----------
    name : str
        "static", "free" or "points".
    recording : Recording
        Markers as the cameras record them.
    truth : Motion
    swivel : (T,) or (T, 2) array
        True elbow swivel of the exploring arm, or of both (right, left), rad.
    point : (T,) integer array
        Index of the point at which the hand is held, -1 elsewhere.
    """

    name: str
    recording: Recording
    truth: Motion
    swivel: Array
    point: NDArray[np.int64]


def place_in_room(
    angles: Array,
    *,
    height: float,
    heading: float,
    sway: tuple[float, float],
    rate: float,
    rng: np.random.Generator,
) -> Array:
    """Place joint angles (T, 18) in a room with Z up, with a swaying trunk, (T, 25).

    `height` is that of the thorax frame over the floor, m; `heading` the direction that
    the body faces, rad about Z; `sway` the standard deviations, m and rad per axis.
    """
    n = len(angles)
    upright = Rotation.from_euler("z", heading) * Rotation.from_euler("x", np.pi / 2)
    turned = wander(rng, n, 3, sd=sway[1], cutoff=_SWAY_HZ, rate=rate)
    shifted = wander(rng, n, 3, sd=sway[0], cutoff=_SWAY_HZ, rate=rate)
    quaternion = (upright * Rotation.from_rotvec(turned)).as_quat()
    # q and -q are the same rotation; the signs are chosen so that q does not jump.
    flips = np.cumprod(np.sign(np.sum(quaternion[1:] * quaternion[:-1], axis=1)))
    quaternion[1:] *= flips[:, None]
    return np.hstack([shifted + [0.0, 0.0, height], quaternion, angles])


def still_joints(
    angles: Array, n: int, *, rate: float, rng: np.random.Generator
) -> Array:
    """Return n samples of joints that are meant to be still, (n, 18) rad."""
    drift = wander(rng, n, len(angles), sd=_STILL_SD, cutoff=_STILL_HZ, rate=rate)
    return angles + drift


def true_motion(skeleton: Skeleton, time: Array, q: Array) -> Motion:
    """Return the truth as a motion; velocities are central differences."""
    position, rotation = skeleton.hands_in_thorax(q)
    steps = np.stack([skeleton.difference(*pair) for pair in pairwise(q)])
    path = np.vstack([np.zeros(skeleton.nv), np.cumsum(steps, axis=0)])
    n = len(q)
    return Motion(
        time=time,
        q=q,
        v=np.gradient(path, time, axis=0),
        joint_names=skeleton.joint_names,
        hand_in_thorax=position,
        hand_rotation_in_thorax=rotation,
        hand_velocity_in_thorax=np.gradient(position, time, axis=0),
        residual=np.zeros(n),
        iterations=np.zeros(n, dtype=np.int64),
        converged=np.ones(n, dtype=bool),
    )


def record_trial(
    arms: Sequence[ArmKinematics],
    q: Array,
    *,
    name: str,
    point: NDArray[np.int64],
    with_static_only: bool,
    noise: float,
    skin: SoftTissue | None,
    occluded: float,
    rate: float,
    rng: np.random.Generator,
) -> Trial:
    """Record a body at configurations (T, 25) with simulated cameras.

    The exploring arms have the skeleton of the person. Settings as those of
    :func:`ikns.simulate_protocol`; `with_static_only` says whether static-only markers
    are worn in this trial.
    """
    skeleton = arms[0].skeleton
    of_noise, of_skin, of_gaps = rng.spawn(3)
    time = np.arange(len(q)) / rate
    markers = skeleton.markers_in_world(q)
    markers += noise * of_noise.normal(size=markers.shape)
    if skin is not None:
        markers += skin.displacement(q, rate=rate, rng=of_skin)
    worn = [
        i
        for i, marker in enumerate(skeleton.marker_set.markers)
        if with_static_only or not marker.static_only
    ]
    links = np.array([skeleton.marker_set.markers[i].link for i in worn])
    labels = [skeleton.marker_set.labels[i] for i in worn]
    markers = markers[:, worn]
    markers[occlusions(of_gaps, len(q), links, share=occluded, rate=rate)] = np.nan
    swivel = skeleton.swivel(q)[:, [SIDES.index(arm.side) for arm in arms]]
    return Trial(
        name=name,
        recording=Recording(time, markers, labels, f"simulated {name} trial"),
        truth=true_motion(skeleton, time, q),
        swivel=swivel[:, 0] if len(arms) == 1 else swivel,
        point=point,
    )
