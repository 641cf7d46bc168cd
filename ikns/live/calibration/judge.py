"""Judges all steps, later ones by what the accepted ones have shown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton, check_chain
from ikns.errors import IknsError, InvalidInput
from ikns.live.calibration.natural_verdict import (
    half_explored,
    judge_natural,
    natural_of,
)
from ikns.live.calibration.point_verdict import judge_point
from ikns.live.calibration.protocol import ProtocolStep
from ikns.live.calibration.verdict import Verdict, judge_free, judge_static
from ikns.motion.motion import Motion
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.recording.recording import Recording


class Judge:
    """Judge recordings with the settings of the calibration to come.

    Parameters
    ----------
    generic : Skeleton
        Body to start from.
    marker_set, chain, n_dof, variance, max_hand_speed, min_static, min_still, min_rest
        See :func:`ikns.calibrate`.

    Attributes
    ----------
    skeleton : Skeleton or None
        The person's, once the static trial is accepted.
    explored : (N, 3) array or None
        Where the hand went in the free exploration, thorax frame, m.
    places : dict of str to (3,) array
        Accepted points, thorax frame, m.

    Raises
    ------
    InvalidInput
        When a setting is out of its range.
    """

    def __init__(
        self,
        generic: Skeleton,
        *,
        marker_set: str = "oxford24",
        chain: ChainLike = "right_arm",
        n_dof: int = 1,
        variance: float = 0.8,
        max_hand_speed: float = 0.05,
        min_static: float = 1.0,
        min_still: float = 0.5,
        min_rest: float = 0.0,
    ) -> None:
        check_chain(generic, chain, n_dof=n_dof)
        n = len(chain_joints(chain))
        for right, sentence in (
            (1 <= n_dof <= n, f"n_dof between 1 and the {n} joints, found {n_dof}"),
            (0 < variance <= 1, f"variance above 0 and at most 1, found {variance:g}"),
            (max_hand_speed > 0, f"max_hand_speed above 0, found {max_hand_speed:g}"),
            (
                0 <= min_static < math.inf,
                f"min_static of 0 s or more, found {min_static:g}",
            ),
            (
                0 <= min_still < math.inf,
                f"min_still of 0 s or more, found {min_still:g}",
            ),
            (0 <= min_rest < math.inf, f"min_rest of 0 s or more, found {min_rest:g}"),
        ):
            if not right:
                raise InvalidInput(f"expected {sentence}.")
        self.chain, self.marker_set = chain, marker_set
        self.skeleton: Skeleton | None = None
        self.explored: NDArray[np.float64] | None = None
        self.places: dict[str, NDArray[np.float64]] = {}
        self._generic, self._min_static = generic, min_static
        self._n_dof, self._variance = n_dof, variance
        self._max_hand_speed, self._min_still = max_hand_speed, min_still
        self._min_rest = min_rest
        self._movement: list[tuple[Skeleton, Motion]] = []
        self._natural: NaturalPosture | None = None
        self._ends: dict[str, tuple[float, float]] = {}
        self._narrow: set[str] = set()

    def judge(self, step: ProtocolStep, recording: Recording | None) -> Verdict:
        """Judge a recording of a step; None stands for no frames."""
        if recording is None:
            return Verdict(False, False, "No frames arrived.", {})
        try:
            return self._judge(step, recording)
        except (IknsError, np.linalg.LinAlgError) as error:
            # The step can still be repeated.
            return Verdict(False, False, f"It cannot be judged: {error}", {})

    def accept(self, step: ProtocolStep, verdict: Verdict) -> None:
        """Store the results of an accepted step."""
        if verdict.skeleton is not None:
            self.skeleton = verdict.skeleton
        if verdict.explored is not None and (
            step.kind == "free" or self.explored is None
        ):
            self.explored = verdict.explored
        if verdict.motion is not None and self.skeleton is not None:
            self._movement.append((self.skeleton, verdict.motion))
            self._natural = None
        if verdict.ends is not None:
            self._ends[step.name] = verdict.ends
        if verdict.place is not None:
            self.places[step.name] = verdict.place

    def _judge(self, step: ProtocolStep, recording: Recording) -> Verdict:
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
        if step.kind == "natural":
            return judge_natural(
                recording,
                self.skeleton,
                chain=self.chain,
                max_hand_speed=self._max_hand_speed,
            )
        return self._judge_point(step, recording, self.skeleton)

    def _judge_point(
        self, step: ProtocolStep, recording: Recording, skeleton: Skeleton
    ) -> Verdict:
        """Judge a point; where it is as narrow again, the elbow goes no farther."""
        if self._natural is None:
            self._natural = natural_of(
                self._movement, self.chain, max_hand_speed=self._max_hand_speed
            )
        others = {k: v for k, v in self._ends.items() if k != step.name}
        found = judge_point(
            recording,
            skeleton,
            chain=self.chain,
            n_dof=self._n_dof,
            variance=self._variance,
            max_hand_speed=self._max_hand_speed,
            min_still=self._min_still,
            min_rest=self._min_rest,
            earlier=self.places,
            natural=self._natural,
            earlier_ends=others,
        )
        if found.ends is None or found.reason != half_explored(found.ends, others):
            return found
        if step.name in self._narrow:
            return replace(
                found, keep=True, reason="The elbow apparently goes no farther here."
            )
        self._narrow.add(step.name)
        return found
