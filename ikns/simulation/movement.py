"""Movements of an arm: reaches between places, and exploring the self-motion at one.

A movement is first a plan: the intended postures of the arm and poses of the hand, one
per sample. Its execution adds drift of the hand and tremor, and solves each sample by
closed-loop inverse kinematics that changes the planned posture as little as possible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from ikns.arrays import Array
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.places import Place
from ikns.simulation.wander import minimum_jerk, tremor, wander

#: Range of the swivel frequency in exploration, Hz: a comfortable pace (assumption).
SWIVEL_HZ = (0.3, 0.6)
#: The same for turning the hand as a second freedom, and the column of forearm
#: pronation among the nine joints of an arm with its clavicle.
_TURN_HZ, _TWIST = (0.2, 0.28), 6
#: Duration of a reach, s, and of each further meter (assumption: the peak speed of a
#: minimum-jerk reach of 0.3 m is then 0.6 m/s, that of unhurried reaching).
_REACH_S, _REACH_S_PER_M = 0.6, 1.2


@dataclass(frozen=True)
class MovementPlan:
    """Intended postures of one arm (T, 9), and poses of its hand in the thorax frame.

    `point` (T,) is the index of the place that is explored, -1 during reaches.
    """

    postures: Array
    position: Array
    rotation: Array
    point: NDArray[np.int64]

    def first(self, n: int) -> MovementPlan:
        """Return the first `n` samples."""
        return MovementPlan(
            self.postures[:n], self.position[:n], self.rotation[:n], self.point[:n]
        )


@dataclass(frozen=True)
class Unsteadiness:
    """Involuntary movement of a hand that is meant to be still.

    Parameters
    ----------
    drift : float
        Slow drift of the hand, m, standard deviation per axis.
    tilt : float
        Slow drift of its orientation, rad, standard deviation per axis.
    drift_hz : float
        Cut-off frequency of both, Hz.
    tremor : float
        Tremor of the hand, m, standard deviation per axis. The mode of postural hand
        tremor is 0.01 g peak at 7 Hz, its range 0.0015 to 0.035 g (Wade, Gresty and
        Findley 1982, Arch Neurol 39:358); 0.05 mm at 10 Hz is 0.02 g.
    tremor_tilt : float
        Tremor of its orientation, rad, standard deviation per axis: the tremor of the
        knuckles seen from the wrist, 0.08 m away.

    Drift and cut-off are assumptions: an unsupported hand that is meant to be still
    moves by about a centimeter within some seconds. The resulting speed, 8 mm/s per
    axis (standard deviation), stays below a threshold of 0.05 m/s. The tilt moves the
    tip of a hand of 0.19 m as much as the drift moves its knuckles.
    """

    drift: float = 4e-3
    tilt: float = np.radians(1.2)
    drift_hz: float = 0.3
    tremor: float = 0.05e-3
    tremor_tilt: float = np.radians(0.03)


def reach_seconds(distance: float) -> float:
    """Return the duration of an unhurried reach over a distance (m), s."""
    return _REACH_S + _REACH_S_PER_M * distance


def reach_samples(start: Place, end: Place, *, rate: float) -> int:
    """Return the number of samples of an unhurried reach."""
    distance = float(np.linalg.norm(end.position - start.position))
    return max(2, round(rate * reach_seconds(distance)))


def reach(start: Place, end: Place, *, n: int) -> MovementPlan:
    """Plan a minimum-jerk reach along a straight line in `n` samples."""
    share = minimum_jerk(n)
    turn = Slerp([0.0, 1.0], Rotation.from_matrix([start.rotation, end.rotation]))
    return MovementPlan(
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
    hand_turn: float = 0.0,
) -> MovementPlan:
    """Plan to hold the hand and swivel the elbow through its range at a place.

    The swivel is a sine with varying frequency (about one in `swivel_hz`, Hz) and
    amplitude (70 to 100 % of the range). It starts and ends at rest in the comfortable
    posture. Without a self-motion at the place the arm does not move. A second freedom
    is a turn of the hand about its long axis by `hand_turn` (rad) to either side, in
    a rhythm of its own.
    """
    n = max(2, round(seconds * rate))
    time = np.arange(n) / rate
    if place.motion is None or len(place.motion.swivel) < 2:
        postures = np.repeat(place.posture[None], n, axis=0)
    else:
        low, high = place.motion.swivel[[0, -1]]
        hertz = rng.uniform(*swivel_hz)
        slow = wander(rng, n, 1, sd=0.1, cutoff=0.3, rate=rate)[:, 0]
        frequency = hertz * np.exp(slow)
        phase = 2 * np.pi * (np.cumsum(frequency) / rate + rng.integers(2) / 2)
        modulation = 2 * np.pi * (0.15 * time + rng.uniform())
        amplitude = 0.85 + 0.15 * np.cos(modulation)
        wave = (low + high) / 2 + (high - low) / 2 * amplitude * np.sin(phase)
        # It takes half a second to start, and to come to rest.
        ramp = minimum_jerk(max(2, min(n // 2, round(0.5 * rate))))
        envelope = np.ones(n)
        envelope[: len(ramp)] = ramp
        envelope[-len(ramp) :] = ramp[::-1] if len(ramp) < n else 0.0
        swivel = place.swivel + envelope * (wave - place.swivel)
        postures = place.motion.at(swivel)
    rotation = np.repeat(place.rotation[None], n, axis=0)
    if hand_turn > 0:
        turn = hand_turn * _turning(n, rate, rng)
        postures = postures + turn[:, None] * (np.arange(postures.shape[1]) == _TWIST)
        # The hand's long axis is its Y, from the fingers to the wrist.
        axis = np.array([0.0, 1.0, 0.0])
        rotation = rotation @ Rotation.from_rotvec(turn[:, None] * axis).as_matrix()
    return MovementPlan(
        postures=postures,
        position=np.repeat(place.position[None], n, axis=0),
        rotation=rotation,
        point=np.full(n, index),
    )


def _turning(n: int, rate: float, rng: np.random.Generator) -> Array:
    """Turn (n,) from -1 to 1, slower than the elbow, from rest to rest at 0."""
    hertz = rng.uniform(*_TURN_HZ) * np.exp(
        wander(rng, n, 1, sd=0.1, cutoff=0.3, rate=rate)[:, 0]
    )
    phase = 2 * np.pi * (np.cumsum(hertz) / rate + rng.uniform())
    ramp = minimum_jerk(max(2, min(n // 2, round(0.5 * rate))))
    envelope = np.ones(n)
    envelope[: len(ramp)] = ramp
    envelope[-len(ramp) :] = ramp[::-1]
    return np.asarray(envelope * np.sin(phase))


def join(plans: Sequence[MovementPlan]) -> MovementPlan:
    """Join plans into one, in order."""
    return MovementPlan(
        *(
            np.concatenate([getattr(plan, name) for plan in plans])
            for name in ("postures", "position", "rotation", "point")
        )
    )


def execute_plan(
    arm: ArmKinematics,
    angles: Array,
    plan: MovementPlan,
    *,
    unsteadiness: Unsteadiness,
    rate: float,
    rng: np.random.Generator,
) -> Array:
    """Return the joint angles of the body (T, 18) while the arm executes a plan."""
    n, u = len(plan.point), unsteadiness
    shift = wander(rng, n, 3, sd=u.drift, cutoff=u.drift_hz, rate=rate)
    shift += tremor(rng, n, 3, sd=u.tremor, rate=rate)
    tilt = wander(rng, n, 3, sd=u.tilt, cutoff=u.drift_hz, rate=rate)
    tilt += tremor(rng, n, 3, sd=u.tremor_tilt, rate=rate)
    position = plan.position + shift
    rotation = Rotation.from_rotvec(tilt).as_matrix() @ plan.rotation
    near = np.array(angles)
    near[:, arm.columns] = plan.postures
    return arm.to_poses(near, position, rotation)


def hand_drift(
    n: int,
    *,
    rate: float,
    seed: int | np.random.Generator,
    unsteadiness: Unsteadiness,
) -> Array:
    """Return the deviation of a hand from its intended pose, m and rad, (n, 6)."""
    rng, u = np.random.default_rng(seed), unsteadiness
    size = np.repeat([[u.drift, u.tilt], [u.tremor, u.tremor_tilt]], 3, axis=1)
    slow = wander(rng, n, 6, sd=1.0, cutoff=u.drift_hz, rate=rate)
    return np.asarray(size[0] * slow + size[1] * tremor(rng, n, 6, sd=1.0, rate=rate))
