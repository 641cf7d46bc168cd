"""The whole chain between the elbow and the finger while the hand moves along a route.

Limb -> swivel of the elbow at the hand's position on the route -> markers with noise,
skin and gaps -> marker IK -> null-space map -> controller -> command to the finger.
"""

from __future__ import annotations

import math

import numpy as np

from ikns.arrays import Array
from ikns.live.control.controller import Controller
from ikns.live.control.frame import MAX_UNCERTAINTY, FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.simulation.body_frames import BodyFrames
from ikns.simulation.grasp.route import Route
from ikns.simulation.operator.cohort import Participant
from ikns.simulation.operator.loop import Delay


class CarriedArm:
    """An arm, cameras and a calibrated map, while the hand moves along a route.

    :class:`ikns.simulation.operator.ArmLoop` is the same for a hand that is held.
    `drift` (n, 6) is the deviation of the hand from the route in each frame, m and rad;
    `latency` the time from a posture to the command to the finger, s. `c` is that of
    the last frame, before latency and smoothing; NaN where the map had none.
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
        self._frames = BodyFrames(
            route.arm,
            route.angles,
            subject,
            drift=drift,
            rate=rate,
            generators=np.random.default_rng(seed).spawn(4),
            marker_noise=float(run.settings["marker_noise"]),  # type: ignore[arg-type]
            occluded=float(run.settings["occluded"]),  # type: ignore[arg-type]
            skin=run.skin,
        )
        limit = MAX_UNCERTAINTY if settings is None else settings.max_uncertainty
        solver = FrameSolver(
            subject.skeleton,
            subject.null_space_map,
            subject.chain,
            max_uncertainty=limit,
        )
        self._controller = Controller(solver, settings)
        self._delay = Delay(latency, rate=rate)

    def step(self, limb: float, s: float) -> float:
        """Take limb and route position of the next frame; return the finger command."""
        time = self.frame / self.rate
        decision = self._controller.frame(self.markers(limb, s), time, time)
        self.c = float(decision.solved.c[0])
        self.frame += 1
        return self._delay.step(decision.flexion)

    def markers(self, limb: float, s: float) -> Array:
        """Return the markers that the cameras record in the next frame, (M, 3) m."""
        return self._frames.markers(self.frame, self.route.row(s, limb))
