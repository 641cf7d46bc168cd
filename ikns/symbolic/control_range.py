"""Available range of the control signal while the hand is held."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.symbolic.held_hand import HeldHand
from ikns.symbolic.posture import start_of
from ikns.symbolic.results import AvailableRange


@dataclass(frozen=True, eq=False)
class ControlRange:
    """The available range of c at a hand, 0 to 1 being the one in use.

    Parameters
    ----------
    lower, upper : float
        Least and greatest c, not clipped: 0 and 1 where exactly the range that the map
        holds is available, below 0 and above 1 where there is more.
    now : float
        c of the given posture.
    share : float
        The range in use over the available one.
    joints : AvailableRange
        The same along Z^ in rad, with postures and what binds.
    """

    lower: float
    upper: float
    now: float
    share: float
    joints: AvailableRange


def available_control(
    hand: HeldHand, learned: NullSpaceMap, q: ArrayLike, *, dof: int = 0
) -> ControlRange:
    """Find the available range of a map's control signal at one posture.

    Parameters
    ----------
    hand : HeldHand
        Of the chain that the map was learned for.
    learned : NullSpaceMap
    q : (18,) or (25,) array
        Joint angles or configuration; (n,) of a robot.
    dof : int
        Which of the map's degrees of freedom.

    Raises
    ------
    InvalidInput
        As :meth:`HeldHand.range`, or where the map has no range at this hand.

    Examples
    --------
    >>> import numpy as np
    >>> from ikns import Skeleton
    >>> skeleton = Skeleton.load()
    >>> q = np.radians([0, 0, 30, 40, 0, 90, 0, 0, 0] * 2)
    >>> [swivel] = skeleton.null_spaces(q, "right_arm")[0]
    >>> right_hand, m = skeleton.hands_in_thorax(q)[0][0], swivel @ q[2:9] - 0.05
    >>> learned = NullSpaceMap.from_arrays([right_hand], [swivel], [m], [m + 0.1])
    >>> found = available_control(HeldHand(skeleton, "right_arm"), learned, q)
    >>> round(found.now, 9), found.lower < 0, found.upper > 1
    (0.5, True, True)
    """
    at = start_of(hand.chain, hand.held, q)
    place = at.positions.mean(axis=1)
    most = learned.directions_.shape[1] - 1
    if not 0 <= dof <= most:
        raise InvalidInput(
            f"expected a degree of freedom from 0 to {most}, found {dof}."
        )
    Z = learned.directions(place)[dof]
    lower, upper = (float(end[dof]) for end in learned.range(place))
    if not upper > lower:
        raise InvalidInput(
            "the map has no range at the hand's place, "
            f"({', '.join(f'{p:.3f}' for p in place)}) m."
        )
    found = hand.range(q, Z)
    width = upper - lower
    wide = found.upper - found.lower
    return ControlRange(
        lower=(found.lower - lower) / width,
        upper=(found.upper - lower) / width,
        now=(float(Z @ at.x) - lower) / width,
        share=width / wide if wide > 0 else float("inf"),
        joints=found,
    )
