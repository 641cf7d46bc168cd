"""The whole chain between an operator's limb and c, simulated frame by frame.

Limb (0 to 1) -> swivel of the elbow along the Jacobian's self-motion, the hand held as
steadily as people can -> markers with noise, skin and gaps -> marker IK -> null-space
map -> c. The simulated body is independent of the map.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from ikns._kernels.body.simulated_markers import write_cubic
from ikns.arrays import Array
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.live.control.controller import Controller
from ikns.live.control.frame import MAX_UNCERTAINTY, FrameSolver
from ikns.live.control.frame_result import ControlFrame
from ikns.live.control.settings import ControlSettings
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.body_frames import BodyFrames, arm_rows
from ikns.simulation.movement import Unsteadiness, hand_drift
from ikns.simulation.operator.loop import Delay
from ikns.simulation.places import Place


class ArmLoop:
    """An arm, cameras and a calibrated map, as an element that an operator controls.

    Parameters
    ----------
    arm, angles
        Of the true body, and the (18,) joint angles of its rest.
    place : Place
        Where the hand is held, with its self-motion.
    subject : Subject
        The same person as calibrated.
    frames : int
        Largest number of frames.
    marker_noise, occluded, skin, unsteadiness
        As in :func:`ikns.simulate_protocol`.
    latency : float
        From a posture to its c on the screen, s, rounded to whole frames.
    settings : ControlSettings, optional
        Smoothing of the live controller; the operator then sees its flexion. Default:
        the raw c of the map.

    Attributes
    ----------
    solved : ControlFrame or None
        The last one, before latency and smoothing.
    """

    def __init__(
        self,
        arm: ArmKinematics,
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
        self.arm, self.place, self.rate, self.frame = arm, place, rate, 0
        self.solved: ControlFrame | None = None
        of_body, of_drift, *others = np.random.default_rng(seed).spawn(5)
        self._frames = BodyFrames(
            arm,
            angles,
            subject,
            drift=hand_drift(
                frames,
                rate=rate,
                seed=of_drift,
                unsteadiness=unsteadiness or Unsteadiness(),
            ),
            rate=rate,
            generators=(of_body, *others),
            marker_noise=marker_noise,
            occluded=occluded,
            skin=skin,
        )
        rows = arm_rows(
            arm, angles, place.motion, skin=skin, columns=self._frames.columns
        )
        spline = CubicSpline(place.motion.swivel, rows)
        self._knots, self._cubics = np.array(spline.x), np.array(spline.c)
        self._row = np.empty(rows.shape[1])
        self._low, self._high = place.motion.swivel[[0, -1]]
        limit = MAX_UNCERTAINTY if settings is None else settings.max_uncertainty
        self._solver = FrameSolver(
            subject.skeleton,
            subject.null_space_map,
            subject.chain,
            max_uncertainty=limit,
        )
        self._controller = (
            None if settings is None else Controller(self._solver, settings)
        )
        self._screen = Delay(latency, rate=rate)

    @property
    def comfortable(self) -> float:
        """Position of the limb in the comfortable posture, 0 to 1."""
        return float((self.place.swivel - self._low) / (self._high - self._low))

    def step(self, limb: float) -> float:
        """Take the limb's next position, 0 to 1; return the c that is seen then."""
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
        """Return the markers that the cameras record in the next frame, (M, 3) m."""
        return self._frames.markers(self.frame, self._arm_row(limb))

    def posture(self, limb: float) -> Array:
        """Return the true configuration of the body in the next frame, (25,)."""
        return self._frames.posture(self.frame, self._arm_row(limb))

    def _arm_row(self, limb: float) -> Array:
        share = min(max(limb, 0.0), 1.0)
        swivel = self._low + share * (self._high - self._low)
        write_cubic(self._knots, self._cubics, swivel, self._row)
        return self._row
