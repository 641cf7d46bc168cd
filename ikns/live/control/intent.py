"""The method intent in a live frame: its constants, and one compiled call."""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.intent_signal import IntentNumbers, intent_signal
from ikns.arrays import Array
from ikns.body.chains import chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import DOWN, FORWARD
from ikns.nullspace.natural_posture import MIDDLE, UNIT
from ikns.nullspace.readout import IntentMap, Readout


class IntentSignal:
    """Control signal of solved poses, as the readout's own to rounding.

    Parameters
    ----------
    skeleton : Skeleton
    readout : Readout
        Of the method intent.

    Raises
    ------
    InvalidInput
        For another method, which the live kernel does not know.
    """

    def __init__(self, skeleton: Skeleton, readout: Readout) -> None:
        learned = readout.map
        if not isinstance(learned, IntentMap):
            raise InvalidInput(
                f"the method '{readout.method}' reads recordings only; live, choose "
                "paper or intent."
            )
        (side,) = chain_sides(readout.chain)
        self._paths = skeleton.paths((f"{side}_upper_arm", f"{side}_hand"))
        natural = learned.natural_
        self._numbers = IntentNumbers(
            coefficients=natural.coefficients_,
            people=natural.people_,
            leverage=natural.leverage_,
            offset=natural.offset_,
            taught_leverage=natural.taught_leverage_,
            guard=bool(natural.guard),
            lower=learned.ends_[0],
            upper=learned.ends_[1],
            mirror=-1.0 if side == "left" else 1.0,
            middle=MIDDLE,
            unit=UNIT,
            forward=FORWARD,
            down=DOWN,
        )
        self._work = np.empty((1, 2, 3, 3)), np.empty((1, 2, 3)), np.empty(10)

    def __call__(self, angles: Array) -> tuple[float, bool]:
        """Return c at joint angles (J,), and whether movement was taught there."""
        return intent_signal(self._paths, self._numbers, angles[None], *self._work)
