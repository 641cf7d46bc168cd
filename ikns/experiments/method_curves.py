"""What c of each method does on a reach, with a turned hand, and at a held hand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import chain_sides
from ikns.calibration.method_summary import TURN
from ikns.calibration.simulated import SwivelSamples
from ikns.calibration.subject import Subject
from ikns.motion.motion import Motion
from ikns.motion.reaches import find_reaches
from ikns.nullspace.map import still_mask
from ikns.nullspace.readout import METHODS
from ikns.nullspace.readout.coordinates import posture_samples
from ikns.nullspace.self_motion import visited_posture

#: A reach goes at least so far, m.
_FAR = 0.10
_TURNS = 59


class MethodCurves(NamedTuple):
    """Control signals by method, not clipped.

    Parameters
    ----------
    reach_time : (T,) array
        s from the start of the reach.
    reach_distance : float
        From start to end, m.
    reach : dict
        Method to c (T,) during the reach.
    turn : (N,) array
        Turn of the forearm, rad.
    turned : dict
        Method to c (N,) while wrist and elbow stay.
    swivel : (S,) array
        True swivel of the elbow at one held place, rad.
    held : dict
        Method to c (S,) there.
    """

    reach_time: Array
    reach_distance: float
    reach: dict[str, Array]
    turn: Array
    turned: dict[str, Array]
    swivel: Array
    held: dict[str, Array]


def method_curves(
    subject: Subject, reaching: Motion, still: SwivelSamples, *, after: float = -np.inf
) -> MethodCurves:
    """Evaluate every method of a subject that was just calibrated.

    Parameters
    ----------
    subject : Subject
        With one exploration, and one degree of freedom.
    reaching : Motion
        Its longest reach is shown; without one, the longest of the exploration.
    still : SwivelSamples
        Of this subject.
    after : float
        Where the part of `reaching` begins that taught the subject nothing, s.
    """
    methods = [m for m in METHODS if m in subject.methods]
    motion, first, last = _longest_reach(subject, reaching, after)
    hand = motion.task_position(subject.chain)
    # The place whose elbow moved most.
    spans = [
        np.ptp(own) if (own := still.swivel[still.labels == k]).size else 0.0
        for k in range(len(subject.null_space_map.centers_))
    ]
    at = int(np.argmax(spans))
    here = (still.labels == at) & np.isfinite(still.swivel)
    gate = still_mask(subject.motions[0], subject.chain)
    turn = np.linspace(-TURN, TURN, _TURNS)
    postures = np.repeat(_posture(subject, at)[None], _TURNS, axis=0)
    for side in chain_sides(subject.chain):
        column = subject.skeleton.joint_names.index(f"{side}_forearm_pronation")
        postures[:, column] += turn
    curves = MethodCurves(
        motion.time[first : last + 1] - motion.time[first],
        float(np.linalg.norm(hand[last] - hand[first])),
        {},
        turn,
        {},
        still.swivel[here],
        {},
    )
    for method in methods:
        readout = subject.readout(method)
        moving = readout.control_signal(subject.skeleton, motion)
        held = readout.control_signal(subject.skeleton, subject.motions[0])[gate]
        x, y = posture_samples(
            subject.skeleton,
            postures,
            subject.chain,
            method,
            reference=readout.reference,
        )
        curves.reach[method] = _one(moving)[first : last + 1]
        curves.turned[method] = _one(readout.map.control_signal(y, readout.led(x)))
        curves.held[method] = _one(held)[here]
    return curves


def _one(c: Array) -> Array:
    """Return the first output, of maps that have a column for each."""
    return c[:, 0] if c.ndim == 2 else c


def _posture(subject: Subject, point: int) -> Array:
    posture = visited_posture(
        subject.skeleton, subject.null_space_map, subject.chain, point
    )
    assert posture is not None  # a map that was just fitted holds its postures
    return posture


def _longest_reach(
    subject: Subject, reaching: Motion, after: float
) -> tuple[Motion, int, int]:
    """Motion, first and last frame."""
    for motion, start in ((reaching, after), (subject.motions[0], -np.inf)):
        hand = motion.task_position(subject.chain)
        ends = find_reaches(motion.hand_speed(subject.chain), hand, min_distance=_FAR)
        ends = ends[motion.time[ends[:, 0]] >= start]
        if len(ends):
            far = np.linalg.norm(hand[ends[:, 1]] - hand[ends[:, 0]], axis=1)
            first, last = ends[int(far.argmax())].tolist()
            return motion, first, last
    # No reach at all: the whole movement.
    return reaching, 0, len(reaching.time) - 1
