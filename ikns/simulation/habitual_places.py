"""Places as people with habits hold them, and their reaches in between.

Where they explore the elbow, they hold the hand so that it has room, a few centimeters
off what they were shown; the elbow starts where it naturally is there. On the way to
anywhere else the hand is held as real ones are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual import habitual_posture, hand_drawn
from ikns.simulation.movement import MovementPlan
from ikns.simulation.places import (
    BOX_HIGH,
    BOX_LOW,
    Place,
    box_points,
    comfortable_posture,
    from_box,
    place_of,
    widest_place,
)
from ikns.simulation.posture_habits import PostureHabits
from ikns.simulation.wander import minimum_jerk

#: People hold the hand 4 to 6 cm off the corners of the box that they are shown; normal
#: errors of 3 cm an axis are 4.8 cm in the mean.
OFF_BOX_SD = 0.03
#: A place at which the elbow has no room is sought nearer to the box, by these shares.
_NEARER = (1.0, 0.5, 0.25, 0.0)
#: Range of the largest swivel to either side of the natural one, rad: 35 deg were
#: explored by the people of the paper, give or take (assumption).
_FARTHEST = np.radians([30.0, 40.0])
#: Pronation, wrist flexion and deviation where the elbow is explored, standard
#: deviation, rad.
_WRIST_SD = np.radians([8, 4, 3])
#: Where the search for the natural swivel starts, and what the shoulder allows, rad.
_FIRST, _LEAST, _MOST = np.radians([38.0, -10.0, 100.0])
_ROUNDS, _TRIES = 4, 50


def natural_swivel(
    arm: ArmKinematics,
    angles: Array,
    position: Array,
    *,
    wrist: Array,
    habits: PostureHabits,
    girdle_rest: Array,
) -> float:
    """Return the swivel of :meth:`ArmKinematics.swivel` that is natural at a place.

    Of the knuckle (3,), m in the thorax frame, with `wrist` (3,) as in
    :func:`ikns.simulation.places.comfortable_posture`, rad.
    """
    mirror, swivel = np.array([1.0, 1.0, arm.outward]), _FIRST
    for _ in range(_ROUNDS):
        posture = comfortable_posture(
            arm, angles, position, swivel=swivel, wrist=wrist, girdle_rest=girdle_rest
        )
        body = arm.put(angles, posture)
        place, now = arm_swivel(arm.skeleton, body, arm.chain)
        way = (arm.hand(body)[0]) * mirror - place
        goal = habits.swivel(place, way / np.linalg.norm(way))
        off = (float(goal - now) + np.pi) % (2 * np.pi) - np.pi
        swivel = min(max(swivel + off, _LEAST), _MOST)
    return swivel


def habitual_places(
    arms: Sequence[ArmKinematics],
    angles: Array,
    *,
    n: int,
    habits: PostureHabits,
    girdle_rest: Array,
    girdle_follow: float,
    rng: np.random.Generator,
) -> tuple[list[Array], list[list[Place]]]:
    """Return positions of each hand at the points (n, 3) m, and places to explore.

    Raises
    ------
    InvalidInput
        When the elbow has no room at a point.
    """
    near = rng.normal(0.0, OFF_BOX_SD, (n, 3))
    layouts = [box_points(arms, angles, n=n, near=share * near) for share in _NEARER]
    scatter = rng.normal(0.0, habits.rest, (n, len(arms)))
    farthest = rng.uniform(_FARTHEST[0], _FARTHEST[1], (n, len(arms)))
    wrists = rng.normal(size=(n, len(arms), 3)) * _WRIST_SD
    places: list[list[Place]] = [[] for _ in arms]
    chosen: list[list[Array]] = [[] for _ in arms]
    for k in range(n):
        for last, layout in enumerate(layouts, start=1 - len(layouts)):
            try:
                found = [
                    _explored(
                        arm,
                        angles,
                        positions[k],
                        wrist=wrists[k, i],
                        scatter=scatter[k, i],
                        farthest=farthest[k, i],
                        habits=habits,
                        girdle_rest=girdle_rest,
                        girdle_follow=girdle_follow,
                    )
                    for i, (arm, positions) in enumerate(zip(arms, layout, strict=True))
                ]
            except InvalidInput:
                if not last:
                    raise
                continue
            for i, place in enumerate(found):
                places[i].append(place)
                chosen[i].append(layout[i][k])
            break
    return [np.array(rows) for rows in chosen], places


def _explored(
    arm: ArmKinematics,
    angles: Array,
    position: Array,
    *,
    wrist: Array,
    scatter: float,
    farthest: float,
    habits: PostureHabits,
    girdle_rest: Array,
    girdle_follow: float,
) -> Place:
    swivel = scatter + natural_swivel(
        arm, angles, position, wrist=wrist, habits=habits, girdle_rest=girdle_rest
    )
    return widest_place(
        arm,
        angles,
        position,
        swivel=swivel,
        wrist=wrist,
        girdle_rest=girdle_rest,
        lowest=swivel - farthest,
        highest=swivel + farthest,
        girdle_follow=girdle_follow,
        enough=0.9 * 2 * farthest,
        remedy="draw another subject",
    )


def habitual_somewhere(
    arm: ArmKinematics,
    angles: Array,
    *,
    habits: PostureHabits,
    girdle_rest: Array,
    rng: np.random.Generator,
) -> Place:
    """Return a random place in the box, held as this person naturally does."""
    for _ in range(_TRIES):
        position = from_box(arm, angles, rng.uniform(BOX_LOW, BOX_HIGH))
        rotation = hand_drawn(arm, angles, position, rng=rng)
        try:
            posture = habitual_posture(
                arm,
                angles,
                position,
                rotation,
                habits=habits,
                scatter=rng.normal(0.0, habits.rest),
                girdle_rest=girdle_rest,
            )
        except InvalidInput:
            continue
        return place_of(arm, angles, posture)
    raise InvalidInput(
        f"the {arm.side} hand reaches no place in the box with a bent elbow; draw "
        "another subject."
    )


def reach_by_joints(
    arm: ArmKinematics, angles: Array, start: Place, end: Place, *, n: int
) -> MovementPlan:
    """Plan a minimum-jerk reach whose joints move together, in `n` samples.

    Between hands that are turned far from each other the hand's path is what the joints
    make of it.
    """
    share = minimum_jerk(n)[:, None]
    postures = start.posture + share * (end.posture - start.posture)
    bodies = np.tile(angles, (n, 1))
    bodies[:, arm.columns] = postures
    position, rotation = arm.hand(bodies)
    return MovementPlan(postures, position, rotation, np.full(n, -1))
