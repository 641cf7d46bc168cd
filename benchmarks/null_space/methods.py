"""What is compared: from one arm's ordinary movement to c of any posture.

Each method is told the movement that is its own (wrist, swivel) and other people's
coefficients, and says c of postures (N, 18), in units of the explored range of 70 deg.
Nobody swivelled on purpose there: what explores is the self-motion in closed form
(:mod:`null_space.turned`), 35 deg to either side, at ten places that the hand visited.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from ikns.body.chains import chain_joints
from ikns.calibration import elbow_reference
from ikns.nullspace.hinge_swivel import arm_swivel, hand_direction
from ikns.nullspace.map import MapWarning, NullSpaceMap
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout.coordinates import (
    elbow_height_gradient,
    mean_orientation,
    rotation_vector,
)
from null_space.people import GATE, Arm, ArmTrial
from null_space.turned import held_hand

Array = np.ndarray
#: From postures (N, 18), rad, and the hand's direction as it was led there (N, 3), to c
#: (N,).
Signal = Callable[[Array, Array], Array]
#: From an arm, its own trials and other people's coefficients to c.
Method = Callable[[Arm, list[ArmTrial], Array], Signal]

#: Explored range of the swivel, rad, and how many postures explore it at a place.
RANGE, STEPS = np.radians(70.0), 41
#: Places, and seconds of ordinary movement at the cameras' 100 Hz.
PLACES, FRAMES = 10, 2000


def own_movement(trials: list[ArmTrial]) -> tuple[Array, Array, Array]:
    """Wrists, swivels and postures of 20 s of movement, evenly of what there is."""
    rows = [trial.known & (trial.speed >= GATE) for trial in trials]
    parts = [
        np.concatenate([part[row] for part, row in zip(whole, rows, strict=True)])
        for whole in (
            [trial.wrist for trial in trials],
            [trial.swivel for trial in trials],
            [trial.angles for trial in trials],
        )
    ]
    n = len(parts[0])
    keep = np.linspace(0, n - 1, min(n, FRAMES)).astype(int)
    return parts[0][keep], parts[1][keep], parts[2][keep]


def explored(arm: Arm, trials: list[ArmTrial]) -> tuple[Array, Array]:
    """Postures (P * STEPS, 18) that swivel at places of the hand, and their place.

    Places: the first where most was, then always what is farthest from all before.
    """
    hands = np.concatenate([trial.hand[trial.known] for trial in trials])
    postures = np.concatenate([trial.angles[trial.known] for trial in trials])
    chosen = [int(cdist(hands[::20], hands).sum(axis=0).argmin())]
    while len(chosen) < PLACES:
        chosen.append(int(cdist(hands, hands[chosen]).min(axis=1).argmax()))
    swivel = np.linspace(-RANGE / 2, RANGE / 2, STEPS)
    rows = np.repeat(postures[chosen], STEPS, axis=0)
    which = np.repeat(np.arange(PLACES), STEPS)
    return held_hand(arm.skeleton, arm.side, rows, np.tile(swivel, PLACES)), which


def _hand(arm: Arm, angles: Array) -> Array:
    return arm.skeleton.link_in_thorax(angles, f"{arm.side}_knuckle")[0]


def _chain(arm: Arm, angles: Array) -> Array:
    names = arm.skeleton.joint_names
    return angles[:, [names.index(joint) for joint in chain_joints(arm.chain)]]


def _map(x: Array, y: Array, which: Array, **parameters: object) -> NullSpaceMap:
    with warnings.catch_warnings():
        # More than one component: 70 deg of swivel are bent in joint angles.
        warnings.simplefilter("ignore", MapWarning)
        return NullSpaceMap(PLACES, **parameters).fit(x, y, groups=which)


def paper(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Z over joint angles between natural neighbors."""
    postures, which = explored(arm, trials)
    x, q = _hand(arm, postures), _chain(arm, postures)
    # What the other arm does has no say.
    middle = np.nan_to_num(np.mean(postures, axis=0))
    learned = _map(
        x, q, which, reference=elbow_reference(arm.skeleton, middle, arm.chain)
    )
    return lambda angles, _: learned.control_signal(
        _chain(arm, angles), _hand(arm, angles)
    )


def proximal(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Z over the upper arm's rotation vector and elbow flexion, smooth fields."""
    postures, which = explored(arm, trials)
    reference = mean_orientation(arm.skeleton, postures, arm.chain)
    flexion = arm.skeleton.joint_names.index(f"{arm.side}_elbow_flexion")

    def read(angles: Array) -> Array:
        turned = arm.skeleton.link_in_thorax(angles, f"{arm.side}_upper_arm")[1]
        return np.hstack([rotation_vector(turned, reference[0]), angles[:, [flexion]]])

    learned = _map(
        _hand(arm, postures),
        read(postures),
        which,
        interpolation="smooth",
        reference=elbow_height_gradient(reference),
    )
    return lambda angles, _: learned.control_signal(read(angles), _hand(arm, angles))


def swivel_about_down(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Swivel of joint centers, zero with the elbow below the line."""
    side = ("right", "left").index(arm.side)
    return lambda angles, _: arm.skeleton.swivel(angles)[:, side] / RANGE


def hinge(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Hinge swivel alone, nothing learned."""
    return lambda angles, _: arm_swivel(arm.skeleton, angles, arm.chain)[1] / RANGE


def _beyond(arm: Arm, natural: NaturalPosture) -> Signal:
    def signal(angles: Array, led: Array) -> Array:
        wrist, swivel = arm_swivel(arm.skeleton, angles, arm.chain)
        return (swivel - natural.swivel(np.hstack([wrist, led]))) / RANGE

    return signal


def _of(people: Array) -> NaturalPosture:
    """Other people's natural posture; nothing of this person is in it."""
    shipped = NaturalPosture.of_people()
    return NaturalPosture.from_arrays(
        people, people, shipped.leverage_, taught_leverage=shipped.taught_leverage_
    )


def people_alone(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Other people's natural posture, nothing of one's own."""
    return _beyond(arm, _of(people))


def intent(
    arm: Arm, trials: list[ArmTrial], people: Array, **parameters: Any
) -> Signal:
    """Hinge swivel less the natural posture; of the wrist alone by ten of `people`."""
    wrist, swivel, angles = own_movement(trials)
    places = np.hstack([wrist, hand_direction(arm.skeleton, angles, arm.chain)])
    if len(people) == 10:
        places = wrist
    natural = NaturalPosture(**parameters).fit(places, swivel, people=people)
    return _beyond(arm, natural)


def intent_without_places(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Remember nothing of particular places."""
    return intent(arm, trials, people, local_penalty=None)


def intent_guarded(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
    """Let the own part of the natural posture fade outside what was taught."""
    return intent(arm, trials, people, guard=True)


METHODS: dict[str, Method] = {
    "paper": paper,
    "proximal": proximal,
    "swivel about down": swivel_about_down,
    "hinge swivel": hinge,
    "people alone": people_alone,
    "intent": intent,
    "intent, no places": intent_without_places,
    "intent, guarded": intent_guarded,
}
