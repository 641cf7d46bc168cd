"""The method intent in a live frame: its constants for the compiled calls."""

from __future__ import annotations

import numpy as np

from ikns._kernels.body import intent_signal as kernel
from ikns._kernels.body.frame_constants import IntentNumbers
from ikns.body.chains import chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.hinge_swivel import DOWN, FORWARD
from ikns.nullspace.local_posture import REACH
from ikns.nullspace.posture_terms import MIDDLE, UNIT
from ikns.nullspace.readout import IntentMap, Readout


def intent_numbers(skeleton: Skeleton, readout: Readout) -> IntentNumbers:
    """Return what the kernels take to read c of intent off joint angles (J,), rad.

    Parameters
    ----------
    skeleton : Skeleton
    readout : Readout
        Of the method intent.

    Raises
    ------
    InvalidInput
        For another method.
    """
    learned = readout.map
    if not isinstance(learned, IntentMap):
        raise InvalidInput(
            f"expected a readout of intent, found one of {readout.method}."
        )
    (side,) = chain_sides(readout.chain)
    paths = skeleton.paths((f"{side}_upper_arm", f"{side}_hand"))
    natural = learned.natural_
    remembered = np.column_stack([natural.places_, natural.heights_])
    # What knows of no hand has no coefficients of its direction.
    direction = np.zeros(3)
    direction[: len(natural.coefficients_) - 10] = natural.coefficients_[10:]
    coefficients, people = natural.coefficients_[:10], natural.people_[:10]
    mirror = -1.0 if side == "left" else 1.0
    angles = np.zeros(len(skeleton.joint_names))
    wrist, rotation = skeleton.link_in_thorax(angles, f"{side}_hand")
    way = (skeleton.link_in_thorax(angles, f"{side}_knuckle")[0] - wrist) @ rotation
    numbers = np.empty(kernel.SIZE + remembered.size)
    for start, values in (
        (kernel.OWN, coefficients - people),
        (kernel.PEOPLE, people),
        (kernel.OFFSET, [natural.offset_, natural.taught_leverage_]),
        (kernel.GUARD, [float(natural.guard)]),
        (kernel.LOWER, learned.ends_),
        (kernel.MIRROR, [mirror]),
        (kernel.MIDDLE, [*MIDDLE, UNIT]),
        (kernel.FORWARD, [*FORWARD, *DOWN]),
        (kernel.REACH, [REACH]),
        (kernel.HAND, way / np.linalg.norm(way)),
        (kernel.DIRECTION, direction * [1.0, 1.0, mirror]),
        (kernel.LEASH, [learned.leash]),
        (kernel.SIZE, remembered.ravel()),
    ):
        numbers[start : start + len(values)] = values
    return IntentNumbers(paths, numbers, np.array(natural.leverage_, order="C"))
