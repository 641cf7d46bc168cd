"""The exercises of the protocol as plans, one per arm and of equal length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual_places import habitual_somewhere, reach_by_joints
from ikns.simulation.movement import (
    SWIVEL_HZ,
    MovementPlan,
    explore,
    join,
    reach,
    reach_samples,
)
from ikns.simulation.places import Place, random_place
from ikns.simulation.posture_habits import PostureHabits


def explore_freely(
    arms: Sequence[ArmKinematics],
    angles: NDArray[np.float64],
    *,
    seconds: float,
    rate: float,
    girdle_rest: NDArray[np.float64],
    habits: PostureHabits | None,
    rng: np.random.Generator,
) -> list[MovementPlan]:
    """Plan free exploration of each arm: reaches from one random place to the next.

    Without `habits` the hand is turned little, and the elbow is anywhere.
    """

    def somewhere() -> list[Place]:
        if habits is None:
            return [
                random_place(arm, angles, rng=rng, girdle_rest=girdle_rest)
                for arm in arms
            ]
        return [
            habitual_somewhere(
                arm, angles, habits=habits, girdle_rest=girdle_rest, rng=rng
            )
            for arm in arms
        ]

    def reaching(starts: list[Place], ends: list[Place]) -> list[MovementPlan]:
        if habits is None:
            return _reach_together(starts, ends, rate)
        m = _samples(starts, ends, rate)
        return [
            reach_by_joints(arm, angles, start, end, n=m)
            for arm, start, end in zip(arms, starts, ends, strict=True)
        ]

    n = max(2, round(seconds * rate))
    stops, reaches, done = somewhere(), [], 0
    while done < n:
        before, stops = stops, somewhere()
        reaches.append(reaching(before, stops))
        done += len(reaches[-1][0].point)
    return [join(plans).first(n) for plans in zip(*reaches, strict=True)]


def explore_points(
    places: Sequence[Sequence[Place]],
    *,
    seconds: float,
    rate: float,
    rng: np.random.Generator,
    hand_turn: float = 0.0,
) -> list[MovementPlan]:
    """Plan to explore one place of each arm after the other, with reaches in between.

    Two elbows move in different rhythms: one in the slow third of the frequencies, the
    other in the fast third. Moving in step they would show one degree of freedom, not
    two. With `hand_turn` (rad) each hand turns too, see
    :func:`ikns.simulation.movement.explore`.
    """
    parts: list[list[MovementPlan]] = []
    low, high = SWIVEL_HZ
    third = (high - low) / 3
    bands = (
        [(low, high)]
        if len(places) == 1
        else [(low, low + third), (high - third, high)]
    )
    stops = list(zip(*places, strict=True))
    for i, stop in enumerate(stops):
        if i:
            parts.append(_reach_together(stops[i - 1], stop, rate))
        parts.append(
            [
                explore(
                    place,
                    seconds=seconds,
                    rate=rate,
                    rng=rng,
                    index=i,
                    swivel_hz=band,
                    hand_turn=hand_turn,
                )
                for place, band in zip(stop, bands, strict=True)
            ]
        )
    return [join(plans) for plans in zip(*parts, strict=True)]


def _reach_together(
    starts: Sequence[Place], ends: Sequence[Place], rate: float
) -> list[MovementPlan]:
    n = _samples(starts, ends, rate)
    return [reach(*pair, n=n) for pair in zip(starts, ends, strict=True)]


def _samples(starts: Sequence[Place], ends: Sequence[Place], rate: float) -> int:
    pairs = zip(starts, ends, strict=True)
    return max(reach_samples(start, end, rate=rate) for start, end in pairs)
