"""Selection of the samples of a motion, or of a robot, that show the null space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike
from ikns.body.skeleton import Robot
from ikns.errors import NotEnoughData
from ikns.motion.marker_ik.rejection import rejection_sentence
from ikns.motion.motion import Motion
from ikns.numerics.turns import nearest_turn, without_turns


def samples_in(seconds: float, rate: float) -> int:
    """How many samples last so long, at a rate in 1/s that files round.

    >>> samples_in(0.5, 100.0), samples_in(0.5, 100.00001), samples_in(0.5, 101.0)
    (50, 50, 51)
    """
    return int(np.ceil(seconds * rate * (1 - 1e-6)))


def still_mask(
    motion: Motion,
    chain: ChainLike = "right_arm",
    *,
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
) -> Mask:
    """Which samples have the chain's hands at rest and all joints known.

    Parameters
    ----------
    motion : Motion
    chain : str
        See :class:`ikns.Chain`.
    max_hand_speed : float
        Hands slower than this in the thorax frame count as still, m/s. Lisini Baldi et
        al. (arXiv 2012.03600) choose it by task; the default is theirs.
    min_duration : float
        Shorter rests are left out, s. A moving hand is slow for about 0.2 s wherever it
        reverses, which shows no null space; 0.5 removes these rests and keeps those of
        a held hand. The default of 0 keeps all, as in the paper.

    Returns
    -------
    (T,) boolean array
        False where hand position, speed, joint angles or joint velocities are missing.
    """
    values = (
        motion.task_position(chain),
        motion.chain_angles(chain),
        motion.chain_velocities(chain),
    )
    gate = np.isfinite(np.hstack(values)).all(axis=1)
    gate &= motion.hand_speed(chain) < max_hand_speed
    ends = np.flatnonzero(np.diff(np.r_[False, gate, False]))
    for first, after in ends.reshape(-1, 2):
        # The last sample may miss the duration by the rounding of its time.
        if motion.time[after - 1] - motion.time[first] < min_duration - 1e-9:
            gate[first:after] = False
    return gate


def null_space_samples(
    motion: Motion,
    chain: ChainLike = "right_arm",
    *,
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
) -> tuple[Array, Array]:
    """Hand positions and joint vectors of the samples with still hands.

    The matching velocities, for ``NullSpaceMap(domain="velocity")``, are
    ``motion.chain_velocities(chain)[still_mask(motion, chain)]``.

    Parameters
    ----------
    motion : Motion
    chain : str
        See :class:`ikns.Chain`.
    max_hand_speed, min_duration : float
        See :func:`still_mask`, m/s and s.

    Returns
    -------
    x : (N, 3) array
        Hand positions (of both hands: their midpoint) in the thorax frame, m.
    q : (N, n) array
        Joint vectors in chain order, rad.

    Raises
    ------
    NotEnoughData
        When no sample passes.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, quick=True
    ... )
    >>> x, q = null_space_samples(run.points.truth)
    >>> len(x) == len(q), q.shape[1]
    (True, 7)
    """
    gate = still_mask(
        motion, chain, max_hand_speed=max_hand_speed, min_duration=min_duration
    )
    if not gate.any():
        raise NotEnoughData(
            no_still_sample([motion], chain, max_hand_speed, min_duration=min_duration)
        )
    return motion.task_position(chain)[gate], motion.chain_angles(chain)[gate]


def no_still_sample(
    motions: Sequence[Motion],
    chain: ChainLike,
    max_hand_speed: float,
    *,
    min_duration: float = 0.0,
) -> str:
    """Say why no sample of these motions has a still hand.

    Arguments as :func:`still_mask` takes them.
    """
    speed = np.concatenate([motion.hand_speed(chain) for motion in motions])
    n, speed = len(speed), speed[np.isfinite(speed)]
    slow = int(np.count_nonzero(speed < max_hand_speed))
    believed = np.concatenate([motion.believed(chain) for motion in motions])
    rejected = [text for m in motions if (text := rejection_sentence(m, chain))]
    found = "none has a known hand speed"
    if lost := [segment for m in motions for segment in m.never_seen(chain)]:
        found = f"none shows it: {lost[0]} is never visible"
    elif rejected and believed.mean() < 0.5:
        found = rejected[0]
    elif slow:
        found = f"the {slow} slower ones are too short a rest or miss joints"
    elif speed.size:
        found = (
            f"the slowest has {speed.min():.3g} m/s and their median is "
            f"{np.median(speed):.3g} m/s; where noise alone is that fast, low-pass the "
            "markers or raise the limit"
        )
    duration = f" for {min_duration:g} s" if min_duration else ""
    return (
        f"expected samples with the hand of {chain} slower than {max_hand_speed:g} "
        f"m/s{duration} and every joint known, but of {n} samples {found}."
    )


def robot_null_space_samples(
    robot: Robot, time: ArrayLike, q: ArrayLike, *, max_hand_speed: float = 0.05
) -> tuple[Array, Array]:
    """Positions of a robot's frame and joint vectors while the frame is held.

    As :func:`null_space_samples` for a person.

    Parameters
    ----------
    robot : Robot
    time : (T,) array
        s, increasing.
    q : (T, n) array
        Joint positions, rad; a full turn more or less is the same posture.
    max_hand_speed : float
        A frame slower than this counts as held, m/s.

    Returns
    -------
    x : (N, 3) array
        Positions of the frame in the base, m.
    q : (N, n) array
        Joint vectors there, rad, without jumps of a full turn (:func:`held_angles`).

    Raises
    ------
    NotEnoughData
        When the frame is never held.
    """
    angles = np.asarray(q, dtype=np.float64)
    place, held = held_frame(robot, time, angles, max_hand_speed=max_hand_speed)
    if not held.any():
        raise NotEnoughData(
            f"expected samples with '{robot.frame}' slower than {max_hand_speed:g} "
            "m/s, found none."
        )
    return place[held], held_angles(robot, angles, held)[held]


def held_frame(
    robot: Robot, time: ArrayLike, q: ArrayLike, *, max_hand_speed: float
) -> tuple[Array, Mask]:
    """Positions of a robot's frame (T, 3), m, and when it is held, (T,).

    Arguments as :func:`robot_null_space_samples` takes them.
    """
    place, _ = robot.pose(q)
    velocity = np.gradient(place, np.asarray(time, dtype=np.float64), axis=0)
    return place, np.asarray(np.linalg.norm(velocity, axis=1) < max_hand_speed)


def held_angles(robot: Robot, q: ArrayLike, held: Mask) -> Array:
    """Joint positions (T, n) of a robot with one angle for one posture, rad or m.

    An angle is known up to full turns only. A joint that cannot make one is brought
    within its limits; any other is followed from row to row and, as a frame is `held`
    again, brought back (:func:`ikns.numerics.turns.without_turns`).
    """
    angles = np.array(q, dtype=np.float64)
    for j in np.flatnonzero(robot.revolute):
        angles[:, j] = (
            without_turns(angles[:, j], held)
            if robot.endless[j]
            else nearest_turn(angles[:, j], (robot.lower[j] + robot.upper[j]) / 2)
        )
    return angles
