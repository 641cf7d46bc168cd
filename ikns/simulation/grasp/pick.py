"""One simulated pick; contact forces alone decide whether it succeeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.finger.inputs import RingButton
from ikns.simulation.grasp.carried_arm import CarriedArm
from ikns.simulation.grasp.person import PRESSING_LOAD, Person
from ikns.simulation.grasp.physics import Grasp, Observation
from ikns.simulation.operator.loop import Delay
from ikns.simulation.operator.model import Operator

Outcome = Literal["success", "dropped", "timeout"]
Feedback = Literal["finger", "signal"]

#: Largest distance of the object from the goal, m (assumption; the paper shows a red
#: circle).
NEAR = 0.05
#: An object that touches the table while the hand is this far above the height for
#: putting it down was dropped, m (assumption).
_PUT_DOWN = 0.03
#: An object lies still if it is slower than this for this time, m/s and s.
_STILL, _STILL_FOR = 0.02, 0.2
#: An object that has risen this far without touching the table was lifted, m.
_LEFT = 0.005
#: An object on the table that moved this far relative to the hand is lost, m.
_LOST = 0.06


class ElbowInput:
    """The finger driven by self-motion: operator, body, cameras, map, controller.

    The operator sees the "finger", which does not show how far c is beyond the contact,
    so the elbow is then held as well as possible; or the "signal" on a screen.
    `crosstalk` is added: how far c falls on the way from object to goal.
    """

    def __init__(
        self,
        operator: Operator,
        arm: CarriedArm,
        *,
        feedback: Feedback = "finger",
        crosstalk: float = 0.0,
    ) -> None:
        if feedback not in ("finger", "signal"):
            raise InvalidInput(
                f"expected feedback of finger or signal, found '{feedback}'."
            )
        self.operator, self.arm, self.feedback = operator, arm, feedback
        self._crosstalk, self._sent = crosstalk, math.nan

    @property
    def c(self) -> float:
        """The raw c of the map in the last frame."""
        return self.arm.c

    def __call__(self, command: float, place: float, seen: Observation) -> float:
        """Take intended command, hand position and observation; return the command."""
        if self.feedback == "signal":
            shown = self._sent
        elif command > seen.flexion and seen.load >= PRESSING_LOAD:
            shown = command
        else:
            shown = seen.flexion
        limb = self.operator.step(command, shown)
        self._sent = self.arm.step(limb, place) - self._crosstalk * max(place, 0.0)
        return self._sent


class RingInput:
    """The finger driven by a button that is pressed after a reaction time."""

    def __init__(self, *, reaction: float, latency: float, rate: float) -> None:
        self._frames, self._rate = 0, rate
        self._ring = RingButton(clock=lambda: self._frames / rate)
        self._reaction = Delay(reaction, rate=rate)
        self._latency = Delay(latency, rate=rate)
        self._closed = False
        self.c = 0.0

    def __call__(self, command: float, place: float, seen: Observation) -> float:
        """Take the intended command; return the command to the finger."""
        if (self._reaction.step(command) > 0.5) is not self._closed:
            self._closed = not self._closed
            self._ring.press()
        self._frames += 1
        self.c = self._ring()[1]
        return self._latency.step(self.c)


@dataclass(frozen=True)
class PickResult:
    """Result of a simulated pick.

    Parameters
    ----------
    why : str
        Reason in words; empty for a success.
    time : float
        From the beginning to the outcome, s.
    phases : (T,) tuple of str
        Phase of the person in each frame.
    trace : (T, 6) array
        c of the map, command to the finger, flexion, force of the finger (N), height of
        the object (m), position of the hand on its route.
    in_hand : (T, 3) array
        Position of the object in the gripper's frame, m.
    """

    outcome: Outcome
    why: str
    time: float
    phases: tuple[str, ...]
    trace: Array
    in_hand: Array

    @property
    def carried(self) -> NDArray[np.bool_]:
        """Frames in which the hand carried the object."""
        return np.array([phase == "carrying" for phase in self.phases])


def pick(
    grasp: Grasp,
    person: Person,
    drive: Callable[[float, float, Observation], float],
    way: Callable[[float], tuple[Array, float]],
    *,
    drift: Array,
    limit: float = 20.0,
) -> PickResult:
    """Simulate a person who picks and places an object.

    `drive` is an :class:`ElbowInput` or a :class:`RingInput`; `way` goes from position
    on the route to the shift of the hand from where it grips, m in the world, and its
    turn about the vertical, rad. `drift` (n, 6) is the deviation of the hand from the
    route, m and rad in the world; `limit` the time limit, s.
    """
    frames = round(limit * grasp.rate)
    if frames < 1 or len(drift) < frames:
        raise InvalidInput(
            f"expected drift for the {frames} frames of a limit above 0 s, found "
            f"{len(drift)}."
        )
    goal, resting = way(1.0)[0], grasp.solid.extent[2] / 2
    seen = grasp.seen()
    phases, trace, in_hand = [], np.empty((frames, 6)), np.empty((frames, 3))
    judge = _Judge(grasp, goal)
    outcome: Outcome = "timeout"
    why = ""
    k = 0
    for k in range(frames):
        person.step(grasp.time, seen)
        command = drive(person.command, person.place, seen)
        shift, yaw = way(person.place)
        turn = drift[k, 3:].copy()
        turn[2] += yaw
        seen = grasp.frame(command, shift + drift[k, :3], turn)
        phases.append(person.phase)
        c = getattr(drive, "c", command)
        height = seen.place[2] - resting  # risen by
        trace[k] = c, command, seen.flexion, seen.finger, height, person.place
        in_hand[k] = seen.in_hand
        ended = judge.step(person.phase, seen, float(shift[2]))
        if ended:
            outcome, why = ended
            break
    else:
        why = f"still {person.phase}"
    n = k + 1
    time = min(grasp.time, limit)
    return PickResult(outcome, why, time, tuple(phases), trace[:n], in_hand[:n])


def arch_length(width: float, height: float) -> float:
    """Return the length of half an ellipse, m, by Ramanujan's first formula.

    >>> round(arch_length(2.0, 1.0) / np.pi, 6)
    1.0
    """
    a, b = width / 2, height
    return float(np.pi * (3 * (a + b) - math.sqrt((3 * a + b) * (a + 3 * b))) / 2)


class _Judge:
    """Decides success or drop from the position of the object and its contacts."""

    def __init__(self, grasp: Grasp, goal: Array) -> None:
        self._goal, self._long = goal, math.ceil(_STILL_FOR * grasp.rate)
        self._rest = grasp.solid.extent[2] / 2
        self._lifted, self._still = False, 0
        self._held: Array | None = None

    def step(
        self, phase: str, seen: Observation, high: float
    ) -> tuple[Outcome, str] | None:
        """Return outcome and reason, or None as long as there is none."""
        if phase not in ("carrying", "placing", "releasing"):
            return None
        if self._held is None:
            self._held = seen.in_hand
        down = seen.table > 0.0
        if not down and seen.place[2] > self._rest + _LEFT:
            self._lifted = True
        off = math.hypot(*(seen.place[:2] - self._goal[:2]))
        if down and not self._lifted:
            if np.linalg.norm(seen.in_hand - self._held) > _LOST:
                return "dropped", "slipped out as the hand rose"
        elif down and off > NEAR:
            return "dropped", f"came down {100 * off:.0f} cm from the goal"
        elif down and high > _PUT_DOWN:
            return "dropped", f"fell with the hand {100 * high:.0f} cm up"
        alone = down and seen.speed < _STILL and seen.finger == 0.0
        self._still = self._still + 1 if alone else 0
        if phase == "releasing" and self._lifted and self._still >= self._long:
            return "success", ""
        return None
