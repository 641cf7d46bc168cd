"""The gate: which samples of a motion show the null space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.errors import NotEnoughData
from ikns.motion import Motion

__all__ = ["null_space_samples", "still"]


def still(
    motion: Motion, chain: str = "right_arm", *, max_hand_speed: float = 0.05
) -> NDArray[np.bool_]:
    """Which samples have the chain's hands at rest while everything is known.

    Parameters
    ----------
    motion : Motion
    chain : str
        See :data:`ikns.motion.CHAINS`.
    max_hand_speed : float
        Hands slower than this, seen from the thorax, count as still, m/s. The default
        is that of Lisini Baldi et al. (arXiv 2012.03600), who let the task decide.

    Returns
    -------
    (T,) boolean array
        False where hand position, speed, joint angles or joint velocities are missing.
    """
    values = (
        motion.place(chain),
        motion.chain_angles(chain),
        motion.chain_velocities(chain),
    )
    known = np.isfinite(np.hstack(values)).all(axis=1)
    return known & (motion.hand_speed(chain) < max_hand_speed)


def null_space_samples(
    motion: Motion, chain: str = "right_arm", *, max_hand_speed: float = 0.05
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Hand positions and joint vectors of the samples whose hands are still.

    The matching velocities, for ``NullSpaceMap(domain="velocity")``, are
    ``motion.chain_velocities(chain)[still(motion, chain)]``.

    Parameters
    ----------
    motion : Motion
    chain : str
        See :data:`ikns.motion.CHAINS`.
    max_hand_speed : float
        See :func:`still`, m/s.

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
    """
    gate = still(motion, chain, max_hand_speed=max_hand_speed)
    if not gate.any():
        speed = motion.hand_speed(chain)
        speed = speed[np.isfinite(speed)]
        found = "none has a known hand speed"
        if speed.size:
            found = f"the slowest has {speed.min():.3g} m/s"
        raise NotEnoughData(
            f"expected samples with the hand of {chain} slower than "
            f"{max_hand_speed:g} m/s and every joint known, but of {len(gate)} samples "
            f"{found}."
        )
    return motion.place(chain)[gate], motion.chain_angles(chain)[gate]
