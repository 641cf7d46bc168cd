"""The body of a virtual subject in the protocol: postures, places, and movement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual_places import habitual_places
from ikns.simulation.movement import MovementPlan, Unsteadiness, execute_plan
from ikns.simulation.places import VERTEX_SD, Place, box_points, explored_places
from ikns.simulation.posture_habits import PostureHabits
from ikns.simulation.subject import VirtualSubject
from ikns.simulation.trial import SEATED_SWAY, place_in_room, still_joints

#: Height of the jugular notch over the floor, share of stature, standing and on a chair
#: (assumptions; no result depends on them).
_STANDING, _SEATED = 0.81, 0.60
#: Sway of the trunk while standing, m and rad, standard deviations (assumption).
_STANDING_SWAY = (5e-3, np.radians(0.5))
#: Postures of an arm, rad, in the order of the chain ``*_arm_clavicle``: for the static
#: trial, a little off the body and a little bent; at rest, with the hand in the lap.
_STATIC = np.radians([0.0, 0.0, 17.0, 8.0, 0.0, 20.0, 0.0, 0.0, 0.0])
RESTING = np.radians([0.0, 0.0, 8.0, 22.0, -25.0, 75.0, 20.0, 0.0, 0.0])
#: Spread of the static posture between persons, rad (assumption).
STATIC_SD = np.radians(2.0)


@dataclass(frozen=True)
class ProtocolBody:
    """Postures and places of a person, the same in all trials.

    `heading` is the direction that the body faces, rad about the vertical; `positions`
    are the intended ones of each hand at the points (P, 3), and `places` those for each
    arm.
    """

    arms: Sequence[ArmKinematics]
    stature: float
    girdle_rest: Array
    heading: float
    sitting: Array
    standing: Array
    positions: list[Array]
    places: list[list[Place]]

    def standing_still(self, n: int, rate: float, rng: np.random.Generator) -> Array:
        """Return n samples of standing still, (n, 25)."""
        return place_in_room(
            still_joints(self.standing, n, rate=rate, rng=rng),
            height=_STANDING * self.stature,
            heading=self.heading,
            sway=_STANDING_SWAY,
            rate=rate,
            rng=rng,
        )

    def seated(
        self,
        plans: Sequence[MovementPlan],
        unsteadiness: Unsteadiness,
        rate: float,
        rng: np.random.Generator,
    ) -> Array:
        """Return the configurations while the seated person executes plans, (T, 25)."""
        n = len(plans[0].point)
        angles = still_joints(self.sitting, n, rate=rate, rng=rng)
        for arm, plan in zip(self.arms, plans, strict=True):
            angles = execute_plan(
                arm, angles, plan, unsteadiness=unsteadiness, rate=rate, rng=rng
            )
        return place_in_room(
            angles,
            height=_SEATED * self.stature,
            heading=self.heading,
            sway=SEATED_SWAY,
            rate=rate,
            rng=rng,
        )


def draw_protocol_body(
    subject: VirtualSubject,
    arms: Sequence[ArmKinematics],
    *,
    n_points: int,
    girdle_follow: float,
    habits: PostureHabits | None,
    rng: np.random.Generator,
) -> ProtocolBody:
    """Draw a person's postures and places; `habits` None: one posture everywhere."""
    girdle_rest = rng.normal(0.0, np.radians([3.0, 2.0]))
    heading = rng.uniform(-np.pi, np.pi)
    sitting = both_arms(subject.skeleton, RESTING)
    standing = both_arms(subject.skeleton, _STATIC)
    standing += rng.normal(0.0, STATIC_SD, len(standing))
    for arm in arms:
        standing[arm.columns[:2]] = girdle_rest
    settings: dict[str, Any] = {
        "girdle_rest": girdle_rest,
        "girdle_follow": girdle_follow,
        "rng": rng,
    }
    if habits is not None:
        positions, places = habitual_places(
            arms, sitting, n=n_points, habits=habits, **settings
        )
    else:
        near = rng.normal(0.0, VERTEX_SD, (n_points, 3))
        positions = box_points(arms, sitting, n=n_points, near=near)
        places = [
            explored_places(arm, sitting, position, **settings)
            for arm, position in zip(arms, positions, strict=True)
        ]
    return ProtocolBody(
        arms,
        subject.adult.stature_m,
        girdle_rest,
        heading,
        sitting,
        standing,
        positions,
        places,
    )


def both_arms(skeleton: Skeleton, posture: Array) -> Array:
    """Joint angles with both arms in the same posture, (18,)."""
    angles = np.zeros(len(skeleton.joint_names))
    for side in SIDES:
        angles = ArmKinematics(skeleton, side).put(angles, posture)
    return angles
