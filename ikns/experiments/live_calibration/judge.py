"""The judge of all steps: what accepted steps taught is what later ones are held to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.experiments.live_calibration.point_verdict import judge_point
from ikns.experiments.live_calibration.protocol import Step
from ikns.experiments.live_calibration.verdict import Verdict, judge_free, judge_static
from ikns.recording import Recording
from ikns.skeleton import Skeleton

__all__ = ["Judge"]


class Judge:
    """Judge recordings with the settings of the calibration to come.

    Parameters
    ----------
    generic : Skeleton
        Body to start from.
    marker_set, chain, n_dof, variance, max_hand_speed, min_static, min_still
        Of :func:`ikns.calibrate`.

    Attributes
    ----------
    skeleton : Skeleton or None
        The person's, once the static trial is accepted.
    explored : (N, 3) array or None
        Where the hand went in the free exploration, thorax frame, m.
    places : dict of str to (3,) array
        Accepted points, thorax frame, m.
    """

    def __init__(
        self,
        generic: Skeleton,
        *,
        marker_set: str = "oxford24",
        chain: str = "right_arm",
        n_dof: int = 1,
        variance: float = 0.8,
        max_hand_speed: float = 0.05,
        min_static: float = 1.0,
        min_still: float = 0.5,
    ) -> None:
        self.chain, self.marker_set = chain, marker_set
        self.skeleton: Skeleton | None = None
        self.explored: NDArray[np.float64] | None = None
        self.places: dict[str, NDArray[np.float64]] = {}
        self._generic, self._min_static = generic, min_static
        self._n_dof, self._variance = n_dof, variance
        self._max_hand_speed, self._min_still = max_hand_speed, min_still

    def judge(self, step: Step, recording: Recording | None) -> Verdict:
        """Say what a recording of a step is good for; None stands for no frames."""
        if recording is None:
            return Verdict(False, False, "No frames came.", {})
        if step.kind == "static":
            return judge_static(
                recording,
                self._generic,
                marker_set=self.marker_set,
                min_static=self._min_static,
            )
        assert self.skeleton is not None, "the static trial comes first"
        if step.kind == "free":
            return judge_free(recording, self.skeleton, chain=self.chain)
        return judge_point(
            recording,
            self.skeleton,
            chain=self.chain,
            n_dof=self._n_dof,
            variance=self._variance,
            max_hand_speed=self._max_hand_speed,
            min_still=self._min_still,
            earlier=self.places,
        )

    def accept(self, step: Step, verdict: Verdict) -> None:
        """Learn from a step that was accepted."""
        if verdict.skeleton is not None:
            self.skeleton = verdict.skeleton
        if verdict.explored is not None:
            self.explored = verdict.explored
        if verdict.place is not None:
            self.places[step.name] = verdict.place
