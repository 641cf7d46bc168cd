"""The frames that every solver of marker_ik.py gets, and the body as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

__all__ = [
    "ACCURACY",
    "RATE",
    "Problem",
    "coordinates",
    "from_coordinates",
    "simulated",
]

Array = NDArray[np.float64]

#: OpenSim's default accuracy of inverse kinematics, and our tolerance of a step.
ACCURACY = 1e-5
#: Frames per second.
RATE = 100.0
#: Share of marker frames that are hidden, and noise of a marker, m per axis: each
#: marker draws its own between these.
OCCLUDED, NOISE = 0.06, (1e-3, 3e-3)


@dataclass(frozen=True)
class Problem:
    """A body, what cameras saw of it, and what it did.

    Parameters
    ----------
    skeleton : Skeleton
        The true body and the true places of its markers.
    recording : Recording
        Markers with noise and gaps, (T, 24, 3) m.
    truth : (T, 25) array
        Configurations.
    start : (25,) array
        Pose before the first frame, the same for every solver.
    """

    skeleton: Skeleton
    recording: Recording
    truth: Array
    start: Array

    @property
    def markers(self) -> Array:
        """What the cameras saw, (T, 24, 3) m."""
        return self.recording.markers

    def plain(self) -> dict[str, object]:
        """Body, frames and start without any class of ours: joints turn about z."""
        tree, (joint, place) = self.skeleton.tree, self.skeleton.tree_markers
        return {
            "parent": tree.parent.tolist(),
            "rotation": tree.rotation,
            "translation": tree.translation,
            "marker_joint": joint.tolist(),
            "marker_place": place,
            "labels": list(self.skeleton.marker_set.labels),
            "markers": self.markers,
            "start": coordinates(self.start),
            "rate": RATE,
            "accuracy": ACCURACY,
        }


def simulated(n: int, seed: int) -> Problem:
    """Both arms of a virtual subject reach from one random place to the next."""
    person = virtual_subject(seed)
    worn = person.skeleton.marker_set
    # All 24 markers, the medial epicondyles too.
    every = tuple(replace(marker, static_only=False) for marker in worn.markers)
    skeleton = person.skeleton.with_markers(replace(worn, markers=every))
    run = simulate_protocol(
        replace(person, skeleton=skeleton),
        seed=seed,
        side="both",
        n_points=1,
        static_seconds=1 / RATE,
        free_seconds=n / RATE,
        point_seconds=1 / RATE,
        marker_noise=0.0,
        occluded=OCCLUDED,
        rate=RATE,
    )
    # Turned upright along the axes, Y up: solvers that write the trunk's orientation as
    # three angles then stay away from gimbal lock.
    turn = Rotation.from_quat(run.free.truth.q[0, 3:7]).inv()
    truth = np.array(run.free.truth.q)
    truth[:, :3] = turn.apply(truth[:, :3])
    truth[:, 3:7] = (turn * Rotation.from_quat(truth[:, 3:7])).as_quat()
    seen = run.free.recording
    rng = np.random.default_rng(seed)
    sd = rng.uniform(*NOISE, size=(len(every), 1))
    markers = turn.apply(seen.markers.reshape(-1, 3)).reshape(seen.markers.shape)
    markers += sd * rng.normal(size=markers.shape)
    recording = Recording(seen.time, markers, seen.labels, "simulated frames")
    start = MarkerIK(skeleton).solve(markers[0]).q
    return Problem(skeleton, recording, truth, start)


def coordinates(q: Array) -> Array:
    """Return the trunk's angles about its own x, y, z, its place, the joint angles."""
    angles = Rotation.from_quat(q[..., 3:7]).as_euler("XYZ")
    return np.concatenate([angles, q[..., :3], q[..., 7:]], axis=-1)


def from_coordinates(x: Array) -> Array:
    """Return the configurations (..., 25) of :func:`coordinates` (..., 24)."""
    turned = Rotation.from_euler("XYZ", x[..., :3]).as_quat()
    return np.concatenate([x[..., 3:6], turned, x[..., 6:]], axis=-1)
