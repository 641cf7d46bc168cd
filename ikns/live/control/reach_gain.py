"""How much reaching alone moves c."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput, NotEnoughData
from ikns.live.control.rate import RateControl, samples_of
from ikns.motion.motion import Motion


def reach_gain(
    control: RateControl, motion: Motion, *, quantile: float = 0.9
) -> NDArray[np.float64]:
    """Change of c per meter of hand path that the reaches of a motion cause.

    The null rate of c divided by the hand's speed while the hand travels: the value not
    exceeded along the share `quantile` of the hand's path. With it as
    ``RateControl(carry=...)``, c does not change along that share of such reaches. A
    deliberate self-motion during a reach is reduced by about as much.

    Parameters
    ----------
    control : RateControl
        Its `carry` is not used.
    motion : Motion
        Reaches of a person who does not intend to move c, such as those between the
        points of a calibration.
    quantile : float
        In [0, 1].

    Returns
    -------
    (d,) array
        1/m.

    Raises
    ------
    NotEnoughData
        When the hand is never both fast and in sight.
    """
    if not 0 <= quantile <= 1:
        raise InvalidInput(f"expected a quantile from 0 to 1, found {quantile}.")
    speed = motion.hand_speed(control.chain)
    rows = np.flatnonzero(speed >= control.max_hand_speed)
    samples = zip(*(array[rows] for array in samples_of(control, motion)), strict=True)
    d = control.c.size
    rates = np.reshape([control.rate(*sample)[0] for sample in samples], (-1, d))
    known = np.isfinite(rates).all(axis=1)
    if not known.any():
        raise NotEnoughData(
            f"expected samples with the hand faster than {control.max_hand_speed:g} "
            f"m/s and every joint known, found none of {len(speed)}."
        )
    hand_speed = speed[rows][known]
    ratios = np.abs(rates[known]) / hand_speed[:, None]
    found = np.empty(d)
    for k, ratio in enumerate(ratios.T):
        order = np.argsort(ratio)
        share = np.cumsum(hand_speed[order]) / hand_speed.sum()
        # Rounding may leave the last share below 1.
        found[k] = ratio[order][min(np.searchsorted(share, quantile), len(order) - 1)]
    return found
