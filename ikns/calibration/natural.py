"""What natural movement and held places must show for the natural posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike, chain_sides
from ikns.errors import NotEnoughData
from ikns.motion.excursion import other_hand_moves
from ikns.motion.motion import Motion

#: Least natural movement of one's own, s; with less, other people's is all there is.
LEAST_NATURAL = 2.0
#: Natural movement within less than this along every axis covers nothing, m.
LEAST_COVERED = 0.10
#: An arm is straight with the elbow bent by less, deg (our choice). Joint centers,
#: which the fit of the body leans on, tell the swivel 9 deg wrong above 45 deg of
#: flexion and 55 deg below 10, because of the carrying angle.
LEAST_BENT = 15.0
#: So many times as far as the chain's own hand the other one moves only where the
#: recording is of the other arm.
_OTHER_SIDE = 3.0


def check_covered(wrist_in_thorax: Array) -> None:
    """Refuse natural movement within one place; wrist centers (N, 3) m.

    Raises
    ------
    NotEnoughData
        When the wrist moves by less than 0.1 m along every axis.
    """
    w = wrist_in_thorax
    span = np.ptp(np.quantile(w, [0.01, 0.99], axis=0), axis=0) if len(w) else 0
    if np.max(span) < LEAST_COVERED:
        raise NotEnoughData(
            f"the hand moves by {_millimeters(float(np.max(span)))}, so this is no "
            "natural movement; record 20 s of reaching and carrying across the whole "
            "workspace."
        )


def _millimeters(meters: float) -> str:
    """Say a width.

    >>> _millimeters(0.0002), _millimeters(0.042)
    ('less than 1 mm', '42 mm')
    """
    return f"{1e3 * meters:.0f} mm" if meters >= 1e-3 else "less than 1 mm"


def check_own_arm(natural: Sequence[Motion], chain: ChainLike) -> None:
    """Refuse natural movement of the other arm.

    Raises
    ------
    NotEnoughData
        When the other hand moves more than three times as far as the chain's.
    """
    if natural and (other := other_hand_moves(natural, chain, times=_OTHER_SIDE)):
        raise NotEnoughData(
            f"expected natural movement of the {chain}, but {other}; record that arm."
        )


def elbow_degrees(motion: Motion, gate: Mask, chain: ChainLike) -> float:
    """Largest median flexion of the chain's elbows in some frames, deg; 0 if unseen."""
    found = [0.0]
    for side in chain_sides(chain):
        column = motion.joint_names.index(f"{side}_elbow_flexion")
        angles = motion.angles[gate, column]
        if np.isfinite(angles).any():
            found.append(float(np.degrees(np.nanmedian(angles))))
    return max(found)
