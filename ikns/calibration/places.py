"""Which still samples are known to be of one place: those of a recording of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.errors import NotEnoughData

#: A hand that moves farther than this is not at one place, m, as in the live
#: calibration, which records each point by itself.
ONE_PLACE = 0.05


def recorded_places(hands_in_thorax: Sequence[Array], *, n_points: int) -> Indices:
    """Place of each still sample by the recording that it is from, -1 for unknown.

    A recording is of one place when nine in ten of its still samples are within 5 cm of
    their median; recordings whose medians are within 5 cm are of the same place.

    Parameters
    ----------
    hands_in_thorax : sequence of (N_i, 3) arrays
        Still hand positions of each recording, m.
    n_points : int
        Where the recordings show more places than this, nothing is known.

    Returns
    -------
    (sum of N_i,) integer array
        Numbers from 0.
    """
    middles: list[Array] = []
    labels = []
    for hand in hands_in_thorax:
        place = -1
        if len(hand):
            middle = np.median(hand, axis=0)
            if np.quantile(np.linalg.norm(hand - middle, axis=1), 0.9) < ONE_PLACE:
                apart = [np.linalg.norm(middle - other) for other in middles]
                place = int(np.argmin(apart)) if apart else 0
                if not apart or apart[place] >= ONE_PLACE:
                    place = len(middles)
                    middles.append(middle)
        labels.append(np.full(len(hand), place))
    known = np.concatenate(labels)
    return known if len(middles) <= n_points else np.full_like(known, -1)


def check_places(hand_in_thorax: Array, *, n_points: int) -> None:
    """Refuse still hands (N, 3) m that are all at one place, where more are asked for.

    Raises
    ------
    NotEnoughData
        When nine in ten are within 5 cm of their median and `n_points` is not 1.
    """
    middle = np.median(hand_in_thorax, axis=0)
    far = float(np.quantile(np.linalg.norm(hand_in_thorax - middle, axis=1), 0.9))
    if n_points > 1 and far < ONE_PLACE:
        raise NotEnoughData(
            f"expected {n_points} held places, found one: the still hand stays within "
            f"{1e3 * far:.0f} mm; hold it at places at least {1e3 * ONE_PLACE:.0f} mm "
            "apart, or ask for 1 with --points."
        )
