"""How far each hand moves, which tells trials of one arm from those of the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, as_chain, end_sides
from ikns.motion.motion import Motion

#: Share of the samples at either end of each axis that do not count.
_ENDS = 5


def hand_excursions(motions: Sequence[Motion]) -> Array:
    """Diagonal of the box in which each hand moves, seen from the thorax, (2,) m.

    From the 5th to the 95th percentile over all motions; NaN for a hand never seen.
    """
    places = np.concatenate([motion.hand_in_thorax for motion in motions])
    found = np.full(len(SIDES), np.nan)
    for side in range(len(SIDES)):
        own = places[:, side]
        own = own[np.isfinite(own).all(axis=1)]
        if len(own):
            low, high = np.percentile(own, [_ENDS, 100 - _ENDS], axis=0)
            found[side] = np.linalg.norm(high - low)
    return found


def other_hand_moves(
    motions: Sequence[Motion], chain: ChainLike, *, times: float = 1.0
) -> str:
    """Say that not a chain's hand moves but the other one; empty where it does not.

    The other one moves more than so many `times` as far. Of two hands none is the
    other, and with joints of the other arm that one moves as it likes.
    """
    sides = end_sides(chain)
    if len(sides) != 1 or as_chain(chain).extrinsic:
        return ""
    (own,) = sides
    other = SIDES[1 - SIDES.index(own)]
    far = dict(zip(SIDES, hand_excursions(motions).tolist(), strict=True))
    if not far[other] > times * far[own]:  # also where one is NaN
        return ""
    return (
        f"the {own} hand moves {100 * far[own]:.0f} cm and the {other} hand "
        f"{100 * far[other]:.0f} cm"
    )
