"""What the arm does: reaches between places, and exploring the self-motion at one.

A movement is first written as a plan: the postures that the arm would take, and the
hand pose that the person means to have, sample by sample. Carrying it out adds what
nobody means (drift of the held pose, tremor) and solves every sample by closed-loop
inverse kinematics, changing the planned posture no more than the hand pose asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from ikns.simulation.arm import Arm
from ikns.simulation.places import Place
from ikns.simulation.wander import minimum_jerk, tremor, wander

__all__ = [
    "SWIVEL_HZ",
    "Plan",
    "Unsteadiness",
    "carry_out",
    "explore",
    "join",
    "reach",
    "reach_samples",
]

Array = NDArray[np.float64]

#: Swivel frequency while exploring, Hz: a comfortable back and forth (assumption).
SWIVEL_HZ = (0.3, 0.6)
#: Reaches take this long plus so much per meter, s (assumption: peak speeds of a
#: minimum-jerk reach of 0.3 m are then 0.6 m/s, those of unhurried reaching).
_REACH_S, _REACH_S_PER_M = 0.6, 1.2


@dataclass(frozen=True)
class Plan:
    """What the person means to do with one arm.

    Parameters
    ----------
    postures : (T, 9) array
        Postures of the arm, rad.
    position : (T, 3) array
        Hand in the thorax frame, m.
    rotation : (T, 3, 3) array
        Hand orientation in the thorax frame.
    point : (T,) integer array
        Index of the place that is explored, -1 on the way.
    """

    postures: Array
    position: Array
    rotation: Array
    point: NDArray[np.int64]

    def first(self, n: int) -> Plan:
        """Return the first `n` samples."""
        return Plan(
            self.postures[:n], self.position[:n], self.rotation[:n], self.point[:n]
        )


@dataclass(frozen=True)
class Unsteadiness:
    """How far from steady the hand is when it is meant to be held.

    Parameters
    ----------
    drift : float
        Slow wandering of the hand, m, standard deviation per axis.
    tilt : float
        Slow wandering of its orientation, rad, standard deviation per axis.
    drift_hz : float
        Cut-off of both.
    tremor : float
        Tremor of the hand, m, standard deviation per axis. The mode of postural hand
        tremor is 0.01 g peak at 7 Hz, its range 0.0015 to 0.035 g (Wade, Gresty and
        Findley 1982, Arch Neurol 39:358); 0.05 mm at 10 Hz is 0.02 g.
    tremor_tilt : float
        Tremor of its orientation, rad, standard deviation per axis: the tremor of the
        knuckles seen from the wrist, 0.08 m away.

    Drift and cut-off are assumptions: a hand that is meant to be still, without a
    support, moves by about a centimeter within some seconds. The speed that follows,
    8 mm/s per axis (standard deviation), stays below a gate of 0.05 m/s. The tilt is
    what moves the tip of a hand of 0.19 m as much as the drift moves its knuckles.
    """

    drift: float = 4e-3
    tilt: float = np.radians(1.2)
    drift_hz: float = 0.3
    tremor: float = 0.05e-3
    tremor_tilt: float = np.radians(0.03)


def reach_samples(start: Place, end: Place, *, rate: float) -> int:
    """How many samples an unhurried reach takes."""
    distance = float(np.linalg.norm(end.position - start.position))
    return max(2, round(rate * (_REACH_S + _REACH_S_PER_M * distance)))


def reach(start: Place, end: Place, *, n: int) -> Plan:
    """Minimum-jerk reach from place to place in `n` samples, straight in space."""
    share = minimum_jerk(n)
    turn = Slerp([0.0, 1.0], Rotation.from_matrix([start.rotation, end.rotation]))
    return Plan(
        postures=start.posture + share[:, None] * (end.posture - start.posture),
        position=start.position + share[:, None] * (end.position - start.position),
        rotation=turn(share).as_matrix(),
        point=np.full(n, -1),
    )


def explore(
    place: Place,
    *,
    seconds: float,
    rate: float,
    rng: np.random.Generator,
    index: int,
    swivel_hz: tuple[float, float] = SWIVEL_HZ,
) -> Plan:
    """Hold the hand and swivel the elbow through the range that the place allows.

    The swivel runs between the ends of the range like a sine of varying frequency and
    amplitude (70 to 100 % of the range), from rest to rest in the comfortable posture.

    Parameters
    ----------
    place : Place
        With its self-motion; without one the arm just stays.
    seconds, rate : float
        How long, and samples per second.
    rng : numpy.random.Generator
        Source of randomness.
    index : int
        Which point this is.
    swivel_hz : (float, float)
        Between which frequencies to choose, Hz.
    """
    n = max(2, round(seconds * rate))
    time = np.arange(n) / rate
    if place.motion is None or len(place.motion.swivel) < 2:
        postures = np.repeat(place.posture[None], n, axis=0)
    else:
        low, high = place.motion.swivel[[0, -1]]
        hertz = rng.uniform(*swivel_hz)
        slow = wander(rng, n, 1, sd=0.1, cutoff=0.3, rate=rate)[:, 0]
        pace = hertz * np.exp(slow)
        phase = 2 * np.pi * (np.cumsum(pace) / rate + rng.integers(2) / 2)
        beat = 2 * np.pi * (0.15 * time + rng.uniform())
        amplitude = 0.85 + 0.15 * np.cos(beat)
        wave = (low + high) / 2 + (high - low) / 2 * amplitude * np.sin(phase)
        # Half a second to get going and to come to rest.
        ramp = minimum_jerk(max(2, min(n // 2, round(0.5 * rate))))
        envelope = np.ones(n)
        envelope[: len(ramp)] = ramp
        envelope[-len(ramp) :] = ramp[::-1] if len(ramp) < n else 0.0
        swivel = place.swivel + envelope * (wave - place.swivel)
        postures = place.motion.at(swivel)
    return Plan(
        postures=postures,
        position=np.repeat(place.position[None], n, axis=0),
        rotation=np.repeat(place.rotation[None], n, axis=0),
        point=np.full(n, index),
    )


def join(plans: Sequence[Plan]) -> Plan:
    """One plan after the other."""
    return Plan(
        *(
            np.concatenate([getattr(plan, name) for plan in plans])
            for name in ("postures", "position", "rotation", "point")
        )
    )


def carry_out(
    arm: Arm,
    angles: Array,
    plan: Plan,
    *,
    unsteadiness: Unsteadiness,
    rate: float,
    rng: np.random.Generator,
) -> Array:
    """Joint angles of the body while the arm follows a plan.

    Parameters
    ----------
    arm : Arm
        The arm that moves.
    angles : (T, 18) array
        Joint angles of the body; those of the arm are replaced.
    plan : Plan
        What the person means to do.
    unsteadiness : Unsteadiness
        What the hand does besides.
    rate : float
        Samples per second.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    (T, 18) array
    """
    n, u = len(plan.point), unsteadiness
    shift = wander(rng, n, 3, sd=u.drift, cutoff=u.drift_hz, rate=rate)
    shift += tremor(rng, n, 3, sd=u.tremor, rate=rate)
    tilt = wander(rng, n, 3, sd=u.tilt, cutoff=u.drift_hz, rate=rate)
    tilt += tremor(rng, n, 3, sd=u.tremor_tilt, rate=rate)
    position = plan.position + shift
    rotation = Rotation.from_rotvec(tilt).as_matrix() @ plan.rotation
    solved = np.array(angles)
    for i in range(n):
        body = arm.put(angles[i], plan.postures[i])
        solved[i] = arm.to_pose(body, position[i], rotation[i])
    return solved
