"""What the experimenter sees between changes: markers, hand, and the way to go."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.live.calibration.judge import Judge
from ikns.live.calibration.protocol import LiveProtocol, ProtocolStep
from ikns.live.calibration.targets import HandTracker, TargetPoints, direction_in_words
from ikns.live.stream import Frame, Source

__all__ = ["Guidance", "CalibrationStatus"]


@dataclass(frozen=True)
class CalibrationStatus:
    """How it stands, for a line on a screen.

    Parameters
    ----------
    state : str
        Of the protocol.
    step : ProtocolStep
    seconds_left : float
        Of the countdown or the recording.
    seen, expected : int
        Markers of the set in the last frame, and how many there are.
    silence : float
        Since the last frame, s.
    hand_speed : float
        Speed of the hand in the thorax frame, m/s; NaN while unknown.
    to_go : float
        Distance of the hand from the suggested place, m; NaN without one.
    way : str
        Which way the hand has to go, in words.
    """

    state: str
    step: ProtocolStep
    seconds_left: float
    seen: int
    expected: int
    silence: float
    hand_speed: float
    to_go: float
    way: str


class Guidance:
    """What the experimenter sees between changes."""

    def __init__(self, source: Source, judge: Judge, n_points: int) -> None:
        self._labels, self._judge, self._n_points = source.labels, judge, n_points
        self._worn = MarkerSet.load(judge.marker_set).without_static()
        self._tracker: tuple[Skeleton, HandTracker] | None = None
        self._guide: tuple[object, TargetPoints] | None = None
        self._before: tuple[float, np.ndarray] | None = None

    def guide(self) -> TargetPoints | None:
        """Places to suggest, once there was a free exploration."""
        explored = self._judge.explored
        if explored is None:
            return None
        if self._guide is None or self._guide[0] is not explored:
            self._guide = (explored, TargetPoints(explored, self._n_points))
        return self._guide[1]

    def where(self, step: ProtocolStep | None) -> str:
        """Where the hand should be, in words; empty where nobody knows."""
        guide = self.guide()
        if guide is None or step is None or step.kind != "point":
            return ""
        return guide.words(_number(step))

    def status(
        self, protocol: LiveProtocol, frame: Frame | None, silence: float
    ) -> CalibrationStatus:
        """Look at the last frame."""
        step = protocol.step
        assert step is not None
        seen, speed, to_go, way = 0, math.nan, math.nan, ""
        if frame is not None:
            markers = self._worn.pick(self._labels, frame.markers)
            seen = int(np.isfinite(markers).all(axis=1).sum())
            place = self._place(frame)
            if place is not None:
                if self._before and frame.device_time > self._before[0]:
                    moved = float(np.linalg.norm(place - self._before[1]))
                    speed = moved / (frame.device_time - self._before[0])
                self._before = (frame.device_time, place)
                guide = self.guide()
                if guide is not None and step.kind == "point":
                    offset = guide.places[_number(step)] - place
                    to_go, way = (
                        float(np.linalg.norm(offset)),
                        direction_in_words(offset),
                    )
        return CalibrationStatus(
            protocol.state,
            step,
            protocol.seconds_left,
            seen,
            len(self._worn.labels),
            silence,
            speed,
            to_go,
            way,
        )

    def _place(self, frame: Frame) -> np.ndarray | None:
        skeleton = self._judge.skeleton
        if skeleton is None:
            return None
        if self._tracker is None or self._tracker[0] is not skeleton:
            tracker = HandTracker(skeleton, self._judge.chain, self._labels)
            self._tracker = (skeleton, tracker)
        return self._tracker[1].place(frame.markers)


def _number(step: ProtocolStep) -> int:
    """Return the number of a point, from 0."""
    return int(step.name.rsplit("_", 1)[-1]) - 1
