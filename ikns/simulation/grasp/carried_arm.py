"""The whole chain behind the elbow of a person whose hand travels, frame by frame.

Limb -> swivel of the elbow at the place where the hand is -> markers with noise, skin
and gaps -> marker IK -> null-space map -> controller -> what the finger is told.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns._kernels.body.tree import place_joints
from ikns.errors import InvalidInput
from ikns.live.control.controller import Controller
from ikns.live.control.frame import FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.simulation.artifacts import occlusions
from ikns.simulation.grasp.route import Route
from ikns.simulation.movement import Unsteadiness
from ikns.simulation.operator.cohort import Participant
from ikns.simulation.operator.loop import Delay
from ikns.simulation.trial import place_in_room
from ikns.simulation.wander import tremor, wander

__all__ = ["CarriedArm", "hand_drift"]

Array = NDArray[np.float64]

#: Sway of the trunk, wandering of joints that are meant to be still, and height of the
#: thorax frame: those of :class:`ikns.simulation.operator.ArmLoop`.
_SWAY = (2e-3, np.radians(0.3))
_STILL, _STILL_HZ = np.radians(0.3), 0.3
_HEIGHT = 1.0


class CarriedArm:
    """An arm, cameras and a calibrated map, with the hand on its way.

    What :class:`ikns.simulation.operator.ArmLoop` is for a hand that stays.

    Parameters
    ----------
    participant : Participant
    route : Route
        Of the same participant.
    drift : (n, 6) array
        How the hand strays from its way, m and rad; as many frames can come.
    rate : float
        Frames per second.
    seed : int or numpy.random.Generator
    latency : float
        From a posture to what the finger is told, s.
    settings : ControlSettings, optional
        Of the controller.

    Attributes
    ----------
    frame : int
        Frames done.
    c : float
        Of the last frame, before latency and smoothing; NaN where the map had none.
    """

    def __init__(
        self,
        participant: Participant,
        route: Route,
        drift: Array,
        *,
        rate: float,
        seed: int | np.random.Generator,
        latency: float = 0.05,
        settings: ControlSettings | None = None,
    ) -> None:
        self.route, self.rate, self.frame, self.c = route, rate, 0, math.nan
        run, subject = participant.protocol, participant.subject
        worn = route.arm.skeleton.marker_set
        columns = subject.skeleton.marker_set.columns(worn.labels)
        links = np.array([worn.markers[i].link for i in columns])
        room, cameras, gaps, slip = np.random.default_rng(seed).spawn(4)
        frames = len(drift)
        still = route.angles + wander(
            room, frames, len(route.angles), sd=_STILL, cutoff=_STILL_HZ, rate=rate
        )
        self._q = place_in_room(
            still, height=_HEIGHT, heading=0.0, sway=_SWAY, rate=rate, rng=room
        )
        self._to_world = Rotation.from_quat(self._q[:, 3:7]).as_matrix()
        self._drift = drift
        noise = float(run.settings["marker_noise"])  # type: ignore[arg-type]
        share = float(run.settings["occluded"])  # type: ignore[arg-type]
        self._noise = noise * cameras.normal(size=(frames, len(links), 3))
        hidden = occlusions(gaps, frames, links, share=share, rate=rate)
        self._noise[hidden] = np.nan
        if run.skin is not None:
            moved = run.skin.at_random(frames, rate=rate, rng=slip)
            self._noise += moved[:, columns]
        joint, in_joint = route.arm.skeleton.tree_markers
        self._joint, self._in_joint = joint[columns], in_joint[columns]
        joints = len(route.arm.skeleton.joint_names) + 1
        self._rotation = np.empty((joints, 3, 3))
        self._translation = np.empty((joints, 3))
        solver = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
        self._controller = Controller(solver, settings)
        self._late = Delay(latency, rate=rate)

    def step(self, limb: float, s: float) -> float:
        """Take limb and place of the next frame; give what the finger is told."""
        time = self.frame / self.rate
        decision = self._controller.frame(self.markers(limb, s), time, time)
        self.c = float(decision.solved.c[0])
        self.frame += 1
        return self._late.step(decision.flexion)

    def body(self, limb: float, s: float) -> Array:
        """Return the true configuration in the coming frame, (25,)."""
        return self._body(self.route.row(s, limb))

    def markers(self, limb: float, s: float) -> Array:
        """Return what the cameras see of the coming frame, (M, 3) m."""
        row = self.route.row(s, limb)
        q, k = self._body(row), self.frame
        tree = self.route.arm.skeleton.tree
        place_joints(tree, q, self._rotation, self._translation)
        markers = np.einsum("mij,mj->mi", self._rotation[self._joint], self._in_joint)
        markers += self._translation[self._joint]
        skin = row[51:].reshape(-1, 3)
        return np.asarray(markers + skin @ self._to_world[k].T + self._noise[k])

    def _body(self, row: Array) -> Array:
        if self.frame >= len(self._drift):
            raise InvalidInput(f"expected {len(self._drift)} frames, found one more.")
        q = self._q[self.frame].copy()
        arm = self.route.arm
        q[7:][arm.columns] = row[:9]
        q[7:][arm.columns[2:]] += row[9:51].reshape(7, 6) @ self._drift[self.frame]
        return q


def hand_drift(
    n: int, *, rate: float, seed: int | np.random.Generator, steady: Unsteadiness
) -> Array:
    """How a hand strays from where it is meant to be, m and rad, (n, 6)."""
    rng, u = np.random.default_rng(seed), steady
    size = np.repeat([[u.drift, u.tilt], [u.tremor, u.tremor_tilt]], 3, axis=1)
    slow = wander(rng, n, 6, sd=1.0, cutoff=u.drift_hz, rate=rate)
    return np.asarray(size[0] * slow + size[1] * tremor(rng, n, 6, sd=1.0, rate=rate))
