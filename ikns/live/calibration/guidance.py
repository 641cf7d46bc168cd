"""What the experimenter sees: markers, hand speed, and where the hand should go."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.live.calibration.judge import Judge
from ikns.live.calibration.protocol import LiveProtocol, ProtocolStep
from ikns.live.calibration.targets import TargetPoints, direction_in_words
from ikns.live.stream import Frame, Source
from ikns.motion.marker_ik import MarkerIK


@dataclass(frozen=True)
class CalibrationStatus:
    """Status of the calibration, for a line on a screen.

    Parameters
    ----------
    state : str
        State of the protocol.
    step : ProtocolStep
    seconds_left : float
        Time left of the countdown or the recording, s.
    seen, expected : int
        Number of markers of the set in the last frame, and in total.
    silence : float
        Time since the last frame, s.
    hand_speed : float
        Speed of the hand in the thorax frame, m/s; NaN while unknown.
    distance : float
        Distance of the hand from the suggested position, m; NaN without one.
    direction : str
        Direction in which the hand should move, in words.
    """

    state: str
    step: ProtocolStep
    seconds_left: float
    seen: int
    expected: int
    silence: float
    hand_speed: float
    distance: float
    direction: str


class HandTracker:
    """Tracks the hand frame by frame.

    Parameters
    ----------
    skeleton : Skeleton
        The person's.
    chain : str
        See :class:`ikns.Chain`.
    labels : sequence of str
        Labels of the frames' markers.
    """

    def __init__(
        self, skeleton: Skeleton, chain: ChainLike, labels: Sequence[str]
    ) -> None:
        self._skeleton, self._labels = skeleton, tuple(labels)
        self._chain = chain
        self._solver = MarkerIK(skeleton)
        self._q: Array | None = None

    def position(self, markers: Array) -> Array | None:
        """Hand, or the mean of both, in the thorax frame, (3,) m; None if not seen."""
        marker_set = self._skeleton.marker_set
        pose = self._solver.solve(marker_set.pick(self._labels, markers), self._q)
        if not math.isfinite(pose.residual):
            return None
        self._q = pose.q
        ends = self._skeleton.chain_ends(pose.q, self._chain)[0]
        return np.asarray(ends.mean(axis=0))


class Guidance:
    """Follows the hand and directs it to the target points.

    Parameters
    ----------
    source : Source
    judge : Judge
    n_points : int
    """

    def __init__(self, source: Source, judge: Judge, n_points: int) -> None:
        self._labels, self._judge, self._n_points = source.labels, judge, n_points
        self._marker_set = MarkerSet.load(judge.marker_set).without_static()
        self._tracker: tuple[Skeleton, HandTracker] | None = None
        self._targets: tuple[object, TargetPoints] | None = None
        self._before: tuple[float, Array] | None = None

    def targets(self) -> TargetPoints | None:
        """Return the target points; None before the free exploration."""
        explored = self._judge.explored
        if explored is None:
            return None
        if self._targets is None or self._targets[0] is not explored:
            self._targets = (explored, TargetPoints(explored, self._n_points))
        return self._targets[1]

    def direction(self, step: ProtocolStep | None) -> str:
        """Direction of a step's target point, in words; empty if unknown."""
        targets = self.targets()
        if targets is None or step is None or step.kind != "point":
            return ""
        return targets.direction(_number(step))

    def status(
        self, protocol: LiveProtocol, frame: Frame | None, silence: float
    ) -> CalibrationStatus:
        """Return the status after the last frame."""
        step = protocol.step
        assert step is not None
        seen, speed, distance, direction = 0, math.nan, math.nan, ""
        if frame is not None:
            markers = self._marker_set.pick(self._labels, frame.markers)
            seen = int(np.isfinite(markers).all(axis=1).sum())
            position = self._hand_position(frame)
            if position is not None:
                if self._before and frame.device_time > self._before[0]:
                    moved = float(np.linalg.norm(position - self._before[1]))
                    speed = moved / (frame.device_time - self._before[0])
                self._before = (frame.device_time, position)
                targets = self.targets()
                if targets is not None and step.kind == "point":
                    offset = targets.positions[_number(step)] - position
                    distance, direction = (
                        float(np.linalg.norm(offset)),
                        direction_in_words(offset),
                    )
        return CalibrationStatus(
            protocol.state,
            step,
            protocol.seconds_left,
            seen,
            len(self._marker_set.labels),
            silence,
            speed,
            distance,
            direction,
        )

    def _hand_position(self, frame: Frame) -> Array | None:
        skeleton = self._judge.skeleton
        if skeleton is None:
            return None
        if self._tracker is None or self._tracker[0] is not skeleton:
            tracker = HandTracker(skeleton, self._judge.chain, self._labels)
            self._tracker = (skeleton, tracker)
        return self._tracker[1].position(frame.markers)


def _number(step: ProtocolStep) -> int:
    """Return the number of a point step, from 0."""
    return int(step.name.rsplit("_", 1)[-1]) - 1
