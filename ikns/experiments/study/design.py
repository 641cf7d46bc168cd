"""Declared parts of a study: the two experiments and the simulation's parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ikns.errors import InvalidInput
from ikns.experiments.picking.objects import OBJECT_IDS
from ikns.experiments.picking.schedule import LIMIT, PickStep, pick_schedule
from ikns.experiments.study.tables import choice, positive
from ikns.experiments.tracking.profiles import CHARACTERS, draw_profile
from ikns.experiments.tracking.schedule import TrackingStep, schedule
from ikns.experiments.tracking.trial import ALIGN

#: Numbers of the points of the calibration box from which the map is learned.
LAYOUTS = {
    "box": tuple(range(10)),
    "corners": tuple(range(8)),
    # Every second corner: no two share an edge of the box.
    "tetrahedron": (0, 2, 5, 7),
}
_INTERPOLATIONS = ("natural", "laplace", "nearest")
_OUTSIDE = ("nearest", "project", "nan")


@dataclass(frozen=True)
class TrackingDesign:
    """Experiment 1, as declared; see :func:`ikns.experiments.tracking.schedule`.

    Parameters
    ----------
    conditions, profiles : tuple of str
        At least two conditions.
    repeats, training : int
    seconds, align, rest : float
        s.
    margin : float, optional
        Margin of equivalence for RMSE, of 100: a difference that does not matter.
        Without it equivalence is not tested.
    """

    conditions: tuple[str, ...] = ("ikns", "gamepad")
    profiles: tuple[str, ...] = ("T1", "T2", "T3")
    repeats: int = 3
    seconds: float = 25.0
    align: float = ALIGN
    training: int = 10
    rest: float = 120.0
    margin: float | None = None

    def __post_init__(self) -> None:
        """Check that the design is possible and has conditions to compare."""
        _check_blocks("tracking", self.conditions, self.repeats, self.training)
        _check_different("tracking", "profiles", self.profiles)
        for name in self.profiles:
            choice("tracking", "profiles", name, CHARACTERS)
        _check_times("tracking", align=self.align, rest=self.rest)
        draw_profile(self.profiles[0], 0, seconds=self.seconds)
        if self.margin is not None:
            positive("tracking", margin=self.margin)

    def arguments(self, *, seed: int) -> dict[str, Any]:
        """Return the schedule's arguments, except for the participant's number."""
        return {
            "conditions": list(self.conditions),
            "profiles": list(self.profiles),
            "repeats": self.repeats,
            "seed": seed,
            "seconds": self.seconds,
            "training": self.training,
            "rest": self.rest,
        }

    def steps(self, number: int, *, seed: int) -> list[TrackingStep]:
        """Return the schedule of a participant, counted from 0."""
        return schedule(number, **self.arguments(seed=seed))


@dataclass(frozen=True)
class PickingDesign:
    """Experiment 2, as declared; see :func:`pick_schedule`.

    Parameters
    ----------
    conditions, objects : tuple of str
        At least two conditions.
    repeats, training : int
    limit, rest : float
        s.
    margin_s : float, optional
        Margin of equivalence for time, s: a difference that does not matter.
    """

    conditions: tuple[str, ...] = ("ikns", "ring")
    objects: tuple[str, ...] = OBJECT_IDS
    repeats: int = 1
    limit: float = LIMIT
    training: int = 10
    rest: float = 120.0
    margin_s: float | None = None

    def __post_init__(self) -> None:
        """Check that the design is possible and has conditions to compare."""
        _check_blocks("picking", self.conditions, self.repeats, self.training)
        _check_different("picking", "objects", self.objects)
        for code in self.objects:
            choice("picking", "objects", code, OBJECT_IDS)
        _check_times("picking", rest=self.rest)
        positive("picking", limit=self.limit)
        if self.margin_s is not None:
            positive("picking", margin_s=self.margin_s)

    def arguments(self, *, seed: int) -> dict[str, Any]:
        """Return the schedule's arguments, except for the participant's number."""
        return {
            "conditions": list(self.conditions),
            "objects": list(self.objects),
            "repeats": self.repeats,
            "seed": seed,
            "limit": self.limit,
            "training": self.training,
            "rest": self.rest,
        }

    def steps(self, number: int, *, seed: int) -> list[PickStep]:
        """Return the schedule of a participant, counted from 0."""
        return pick_schedule(number, **self.arguments(seed=seed))


@dataclass(frozen=True)
class Parameters:
    """Parameters of virtual participants: recording, calibration, live control.

    Parameters
    ----------
    rate : float
        Frames per second.
    max_hand_speed : float
        Hand speed below which the calibration uses a sample, m/s.
    n_points : int
        Points of the calibration box, 5 to 10.
    layout : {"box", "corners", "tetrahedron"}
        From which of them the map is learned: all, the corners, every second corner.
    interpolation : {"natural", "laplace", "nearest"}
        Between the points: natural neighbors by volume or by area, or the nearest
        point.
    outside : {"nearest", "project", "nan"}
        Extrapolation of the map. It matters in picking only: while tracking, the hand
        is held in the middle of the points.
    point_seconds : float
        Time at each point, s.
    marker_noise : float
        Camera noise, m, standard deviation per axis.
    occluded : float
        Share of marker frames that the cameras miss.
    soft_tissue : float
        Displacement of the markers over the bones, m, root mean square.
    latency : float
        From a posture to its c, s.
    smoothing : bool
        Whether c is smoothed in tracking as the live loop does it. In picking the live
        controller always drives the finger.
    """

    rate: float = 100.0
    max_hand_speed: float = 0.05
    n_points: int = 10
    layout: str = "box"
    interpolation: str = "natural"
    outside: str = "nearest"
    point_seconds: float = 5.0
    marker_noise: float = 1e-3
    occluded: float = 0.03
    soft_tissue: float = 3e-3
    latency: float = 0.05
    smoothing: bool = False

    def __post_init__(self) -> None:
        """Check that the parameters are possible."""
        where = "parameters"
        positive(
            where,
            rate=self.rate,
            max_hand_speed=self.max_hand_speed,
            point_seconds=self.point_seconds,
        )
        for name in ("marker_noise", "soft_tissue", "latency", "occluded"):
            value = getattr(self, name)
            if not 0 <= value < (0.5 if name == "occluded" else math.inf):
                raise InvalidInput(
                    f"expected {name} of at least 0 in [{where}]"
                    f"{' and below 0.5' * (name == 'occluded')}, found {value:g}."
                )
        if not 20.0 <= self.rate <= 1000.0:
            raise InvalidInput(
                f"expected a rate of 20 to 1000 in [{where}], found {self.rate:g}."
            )
        if not 5 <= self.n_points <= 10:
            raise InvalidInput(
                f"expected n_points of 5 to 10 in [{where}], found {self.n_points}."
            )
        choice(where, "layout", self.layout, LAYOUTS)
        choice(where, "interpolation", self.interpolation, _INTERPOLATIONS)
        choice(where, "outside", self.outside, _OUTSIDE)
        if self.layout != "box" and self.n_points <= max(LAYOUTS[self.layout]):
            raise InvalidInput(
                f"expected n_points above {max(LAYOUTS[self.layout])} in [{where}] for "
                f"the layout '{self.layout}', found {self.n_points}."
            )

    @property
    def points(self) -> tuple[int, ...]:
        """Numbers of the points from which the map is learned, from 0."""
        return tuple(k for k in LAYOUTS[self.layout] if k < self.n_points)


def _check_blocks(
    where: str, conditions: Sequence[str], repeats: int, training: int
) -> None:
    _check_different(where, "conditions", conditions)
    if len(conditions) < 2:
        raise InvalidInput(
            f"expected at least two conditions to compare in [{where}], found "
            f"{', '.join(conditions)}."
        )
    if repeats < 1:
        raise InvalidInput(
            f"expected at least one repeat in [{where}], found {repeats}: no trial "
            "would be left."
        )
    if training < 0:
        raise InvalidInput(
            f"expected training from 0 trials in [{where}], found {training}."
        )


def _check_different(where: str, key: str, words: Sequence[str]) -> None:
    if not words or "" in words or len(set(words)) != len(words):
        raise InvalidInput(
            f"expected distinct {key} in [{where}], found {', '.join(words) or 'none'}."
        )


def _check_times(where: str, **numbers: Any) -> None:
    for name, value in numbers.items():
        if not 0 <= value < math.inf:
            raise InvalidInput(
                f"expected {name} from 0 s in [{where}], found {value:g}."
            )
