"""One object picked, carried and placed, decided by contact forces alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput
from ikns.finger.inputs import RingButton
from ikns.simulation.grasp.carried_arm import CarriedArm
from ikns.simulation.grasp.person import PRESSES, Person
from ikns.simulation.grasp.physics import Grasp, Seen
from ikns.simulation.operator.loop import Delay
from ikns.simulation.operator.model import Operator

__all__ = ["Elbow", "Picked", "Ring", "arch_length", "pick"]

Array = NDArray[np.float64]
Outcome = Literal["success", "dropped", "timeout"]
Sees = Literal["finger", "signal"]

#: How near the goal the object must lie, m: inside a circle of a decimeter (assumption;
#: the paper shows a red circle).
NEAR = 0.05
#: An object that meets the table while the hand is higher than this over where it puts
#: things down was not put down, m (assumption).
_PUT_DOWN = 0.03
#: What lies still: slower than this for so long, m/s and s.
_STILL, _STILL_FOR = 0.02, 0.2
#: An object that has risen by so much, and touches nothing below, was lifted, m.
_LEFT = 0.005
#: A hand that has gone so far from an object on the table has lost it, m.
_LOST = 0.06


class Elbow:
    """The self-motion drives the finger: operator, body, cameras, map, controller.

    Parameters
    ----------
    operator : Operator
        Fresh.
    arm : CarriedArm
    sees : {"finger", "signal"}
        What the operator goes by. The finger: once it is felt to press, nothing tells
        how much further c is, so the elbow stays where it is, as well as it can. Or the
        signal on a screen, whatever the finger does.
    planted : float
        Crosstalk to add: by how much c falls on the way from object to goal.
    """

    def __init__(
        self,
        operator: Operator,
        arm: CarriedArm,
        *,
        sees: Sees = "finger",
        planted: float = 0.0,
    ) -> None:
        if sees not in ("finger", "signal"):
            raise InvalidInput(f"expected to see finger or signal, found '{sees}'.")
        self.operator, self.arm, self.sees = operator, arm, sees
        self._planted, self._told = planted, math.nan

    @property
    def c(self) -> float:
        """The map's, of the last frame."""
        return self.arm.c

    def __call__(self, want: float, place: float, seen: Seen) -> float:
        """Take what the person wants, where the hand is, what is seen: tell it."""
        if self.sees == "signal":
            shown = self._told
        elif want > seen.flexion and seen.load >= PRESSES:
            shown = want
        else:
            shown = seen.flexion
        limb = self.operator.step(want, shown)
        self._told = self.arm.step(limb, place) - self._planted * max(place, 0.0)
        return self._told


class Ring:
    """A button drives the finger: pressed a reaction after the person wants it."""

    def __init__(self, *, reaction: float, latency: float, rate: float) -> None:
        self._frames, self._rate = 0, rate
        self._ring = RingButton(clock=lambda: self._frames / rate)
        self._late = Delay(reaction, rate=rate)
        self._told = Delay(latency, rate=rate)
        self._closed = False
        self.c = 0.0

    def __call__(self, want: float, place: float, seen: Seen) -> float:
        """Take what the person wants; tell the finger."""
        if (self._late.step(want) > 0.5) is not self._closed:
            self._closed = not self._closed
            self._ring.press()
        self._frames += 1
        self.c = self._ring()[1]
        return self._told.step(self.c)


@dataclass(frozen=True)
class Picked:
    """What came of it; simulated.

    Parameters
    ----------
    outcome : {"success", "dropped", "timeout"}
    why : str
        In words; empty for a success.
    time : float
        From the beginning to the outcome, s.
    doing : (T,) tuple of str
        What the person did in each frame.
    trace : (T, 6) array
        c of the map, what the finger was told, flexion, force of the finger (N), height
        of the object (m), place of the hand on its way.
    in_hand : (T, 3) array
        Object in the gripper's frame, m.
    """

    outcome: Outcome
    why: str
    time: float
    doing: tuple[str, ...]
    trace: Array
    in_hand: Array

    @property
    def carried(self) -> NDArray[np.bool_]:
        """Frames in which the hand travelled with the object."""
        return np.array([doing == "carrying" for doing in self.doing])


def pick(
    grasp: Grasp,
    person: Person,
    drive: Callable[[float, float, Seen], float],
    way: Callable[[float], tuple[Array, float]],
    *,
    drift: Array,
    limit: float = 20.0,
) -> Picked:
    """Let a person pick an object and place it.

    Parameters
    ----------
    grasp : Grasp
        Fresh; it sets the rate.
    person : Person
        Fresh.
    drive : callable
        What the person wants the finger to be told (0 to 1), the place of the hand on
        its way and what is seen, to what the finger is told: an :class:`Elbow`, a
        :class:`Ring`.
    way : callable
        Place on the way to where the hand is from where it grips, m in the world, and
        how far it has turned about the vertical, rad.
    drift : (n, 6) array
        How the hand strays from that, m and rad in the world.
    limit : float
        s.
    """
    frames = round(limit * grasp.rate)
    if frames < 1 or len(drift) < frames:
        raise InvalidInput(
            f"expected drift for the {frames} frames of a limit above 0 s, found "
            f"{len(drift)}."
        )
    goal = way(1.0)[0]
    seen = grasp.seen()
    doing, trace, in_hand = [], np.empty((frames, 6)), np.empty((frames, 3))
    judge = _Judge(grasp, goal)
    outcome: Outcome = "timeout"
    why = ""
    k = 0
    for k in range(frames):
        person.step(grasp.time, seen)
        told = drive(person.want, person.place, seen)
        shift, yaw = way(person.place)
        turn = drift[k, 3:] + [0.0, 0.0, yaw]
        seen = grasp.frame(told, shift + drift[k, :3], turn)
        doing.append(person.doing)
        c = getattr(drive, "c", told)
        height = seen.place[2] - grasp.solid.extent[2] / 2  # of its middle, risen
        trace[k] = c, told, seen.flexion, seen.finger, height, person.place
        in_hand[k] = seen.in_hand
        ended = judge.step(person.doing, seen, float(shift[2]))
        if ended:
            outcome, why = ended
            break
    else:
        why = f"still {person.doing}"
    n = k + 1
    time = min(grasp.time, limit)
    return Picked(outcome, why, time, tuple(doing), trace[:n], in_hand[:n])


def arch_length(width: float, height: float) -> float:
    """Length of the arch over a width with a height, m (Ramanujan's first formula).

    >>> round(arch_length(2.0, 1.0) / np.pi, 6)
    1.0
    """
    a, b = width / 2, height
    return float(np.pi * (3 * (a + b) - math.sqrt((3 * a + b) * (a + 3 * b))) / 2)


class _Judge:
    """Success or drop, by where the object is and what touches it."""

    def __init__(self, grasp: Grasp, goal: Array) -> None:
        self._goal, self._long = goal, math.ceil(_STILL_FOR * grasp.rate)
        self._rest = grasp.solid.extent[2] / 2
        self._lifted, self._still = False, 0
        self._held: Array | None = None

    def step(self, doing: str, seen: Seen, high: float) -> tuple[Outcome, str] | None:
        """Return outcome and reason once there is one."""
        if doing not in ("carrying", "placing", "releasing"):
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
        if doing == "releasing" and self._lifted and self._still >= self._long:
            return "success", ""
        return None
