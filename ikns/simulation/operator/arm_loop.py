"""The whole chain behind an operator's limb, simulated one frame at a time.

Limb (0 to 1) -> swivel of the elbow along the Jacobian's self-motion, the hand held as
well as people can -> markers with noise, skin and gaps -> marker IK -> null-space map
-> c. Nothing of the body knows of the map.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ikns._kernels.body.tree import place_joints
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.live.control.controller import Controller
from ikns.live.control.frame import ControlFrame, FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.simulation.arm import Arm
from ikns.simulation.artifacts import SoftTissue, occlusions
from ikns.simulation.movement import Unsteadiness
from ikns.simulation.operator.loop import Delay
from ikns.simulation.places import Place
from ikns.simulation.trial import place_in_room
from ikns.simulation.wander import tremor, wander

__all__ = ["ArmLoop"]

Array = NDArray[np.float64]

#: Sway of the trunk on a chair, m and rad per axis, and wandering of joints that are
#: meant to be still, rad: those of the simulated protocol (assumptions).
_SWAY = (2e-3, np.radians(0.3))
_STILL, _STILL_HZ = np.radians(0.3), 0.3
#: Height of the thorax frame, m: no result depends on it.
_HEIGHT = 1.0


class ArmLoop:
    """An arm, cameras, and a calibrated map: what the operator's limb drives.

    What the loop cannot influence (sway, drift, tremor, noise, gaps) is drawn
    beforehand for all frames; posture, markers, pose and c are computed as the limb
    goes. The drift of the hand is added to the joints by the pseudo-inverse of the
    Jacobian, right to first order.

    Parameters
    ----------
    arm : Arm
        Of the true body.
    angles : (18,) array
        Joint angles of the rest of it.
    place : Place
        Where the hand is held, with its self-motion.
    subject : Subject
        The same person as calibrated.
    frames : int
        How many will come at most.
    rate : float
        Frames per second.
    seed : int or numpy.random.Generator
    marker_noise : float
        Camera noise, m, standard deviation per axis.
    occluded : float
        Share of marker frames that the cameras miss.
    skin : SoftTissue, optional
    unsteadiness : Unsteadiness, optional
        How still the hand is held.
    latency : float
        From a posture to its c on the screen, s, in whole frames.
    settings : ControlSettings, optional
        Smoothing of the live controller; the operator then sees its flexion. Default:
        the map's c as it is.

    Attributes
    ----------
    frame : int
        Frames done.
    solved : ControlFrame or None
        The last one, before latency and smoothing.
    """

    def __init__(
        self,
        arm: Arm,
        angles: Array,
        place: Place,
        subject: Subject,
        *,
        frames: int,
        rate: float,
        seed: int | np.random.Generator,
        marker_noise: float = 1e-3,
        occluded: float = 0.03,
        skin: SoftTissue | None = None,
        unsteadiness: Unsteadiness | None = None,
        latency: float = 0.03,
        settings: ControlSettings | None = None,
    ) -> None:
        if place.motion is None or len(place.motion.swivel) < 4:
            raise InvalidInput("expected a place with room to swivel the elbow.")
        self.arm, self.place, self.rate, self.frames = arm, place, rate, frames
        self.frame = 0
        self.solved: ControlFrame | None = None
        worn = arm.skeleton.marker_set
        self._columns = subject.skeleton.marker_set.columns(worn.labels)
        links = np.array([worn.markers[i].link for i in self._columns])
        room, shake, cameras, gaps, slip = np.random.default_rng(seed).spawn(5)
        still = angles + wander(
            room, frames, len(angles), sd=_STILL, cutoff=_STILL_HZ, rate=rate
        )
        self._q = place_in_room(
            still, height=_HEIGHT, heading=0.0, sway=_SWAY, rate=rate, rng=room
        )
        self._to_world = Rotation.from_quat(self._q[:, 3:7]).as_matrix()
        self._drift = _drift(unsteadiness or Unsteadiness(), frames, rate, shake)
        self._noise = marker_noise * cameras.normal(size=(frames, len(links), 3))
        self._noise[occlusions(gaps, frames, links, share=occluded, rate=rate)] = np.nan
        if skin is not None:
            # Turned with its segment or not, what is random in all directions alike
            # stays so.
            moved = skin.at_random(frames, rate=rate, rng=slip)
            self._noise += moved[:, self._columns]
        self._low, self._high = place.motion.swivel[[0, -1]]
        joint, in_joint = arm.skeleton.tree_markers
        self._joint, self._in_joint = joint[self._columns], in_joint[self._columns]
        joints = len(arm.skeleton.joint_names) + 1
        self._rotation = np.empty((joints, 3, 3))
        self._translation = np.empty((joints, 3))
        self._way = self._along(angles, skin)
        self._solver = FrameSolver(
            subject.skeleton, subject.null_space_map, subject.chain
        )
        self._controller = (
            None if settings is None else Controller(self._solver, settings)
        )
        self._screen = Delay(latency, rate=rate)

    @property
    def comfortable(self) -> float:
        """Limb at which the elbow hangs as it likes, 0 to 1."""
        return float((self.place.swivel - self._low) / (self._high - self._low))

    def step(self, limb: float) -> float:
        """Take the limb of the next frame, 0 to 1; give the c seen then."""
        markers = self.markers(limb)
        time = self.frame / self.rate
        if self._controller is None:
            solved = self._solver.solve(markers)
            c = float(solved.c[0])
        else:
            decision = self._controller.frame(markers, time, time)
            solved, c = decision.solved, decision.flexion
        self.solved = solved
        self.frame += 1
        return self._screen.step(c)

    def markers(self, limb: float) -> Array:
        """Return what the cameras see of the coming frame, (M, 3) m.

        The markers are those that the calibrated body wears.

        Raises
        ------
        InvalidInput
            After the last frame.
        """
        q, skin = self._body(limb)
        place_joints(self.arm.skeleton.tree, q, self._rotation, self._translation)
        markers = np.einsum("mij,mj->mi", self._rotation[self._joint], self._in_joint)
        markers += self._translation[self._joint]
        k = self.frame
        return np.asarray(markers + skin @ self._to_world[k].T + self._noise[k])

    def posture(self, limb: float) -> Array:
        """Return the true configuration of the body in the coming frame, (25,)."""
        return self._body(limb)[0]

    def _body(self, limb: float) -> tuple[Array, Array]:
        """Find the configuration, and what skin adds in the thorax frame."""
        if self.frame >= self.frames:
            raise InvalidInput(f"expected {self.frames} frames, found one more.")
        share = min(max(limb, 0.0), 1.0)
        row = self._way(self._low + share * (self._high - self._low))
        q = self._q[self.frame].copy()
        q[7:][self.arm.columns] = row[:9]
        drift = row[9:51].reshape(7, 6) @ self._drift[self.frame]
        q[7:][self.arm.columns[2:]] += drift
        return q, row[51:].reshape(-1, 3)

    def _along(self, angles: Array, skin: SoftTissue | None) -> CubicSpline:
        """Posture, pseudo-inverse and skin (thorax frame) over the swivel."""
        motion, skeleton = self.place.motion, self.arm.skeleton
        assert motion is not None
        bodies = np.array([self.arm.put(angles, p) for p in motion.postures])
        inverse = [
            np.linalg.pinv(skeleton.chain_jacobian(body, self.arm.chain)).ravel()
            for body in bodies
        ]
        q = np.hstack([np.tile(skeleton.neutral()[:7], (len(bodies), 1)), bodies])
        shift = np.zeros((len(q), len(self._columns), 3))
        if skin is not None:
            shift = skin.in_world(q, skin.with_posture(q))[:, self._columns]
        rows = np.hstack([motion.postures, inverse, shift.reshape(len(q), -1)])
        return CubicSpline(motion.swivel, rows)


def _drift(u: Unsteadiness, n: int, rate: float, rng: np.random.Generator) -> Array:
    """How the hand wanders off its pose, m and rad, (n, 6)."""
    size = np.repeat([[u.drift, u.tilt], [u.tremor, u.tremor_tilt]], 3, axis=1)
    slow = wander(rng, n, 6, sd=1.0, cutoff=u.drift_hz, rate=rate)
    return size[0] * slow + size[1] * tremor(rng, n, 6, sd=1.0, rate=rate)
