"""The method proximal in a live frame: its constants for the compiled call."""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.proximal_signal import ProximalNumbers
from ikns.body.chains import whole_arms
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.smooth import SmoothField
from ikns.nullspace.readout import Readout


def proximal_numbers(skeleton: Skeleton, readout: Readout) -> ProximalNumbers:
    """Return what the kernel takes to read c of proximal off joint angles.

    Parameters
    ----------
    skeleton : Skeleton
    readout : Readout
        Of the method proximal.

    Raises
    ------
    InvalidInput
        When the map is not a smooth one of whole arms.
    """
    learned, reference = readout.map, readout.reference
    sides = whole_arms(readout.chain)
    known = isinstance(learned, NullSpaceMap) and reference is not None and sides
    field = learned.interpolator_ if isinstance(learned, NullSpaceMap) else None
    if not (known and isinstance(field, SmoothField)):
        raise InvalidInput(
            f"expected a smooth map of proximal of whole arms, found one of "
            f"{readout.method} of {readout.chain}; calibrate again to use it live."
        )
    assert isinstance(learned, NullSpaceMap)
    smoother, metric, middle = field.numbers
    flexion = [skeleton.joint_names.index(f"{side}_elbow_flexion") for side in sides]
    return ProximalNumbers(
        arms=skeleton.paths(tuple(f"{side}_upper_arm" for side in sides)),
        hands=skeleton.paths(tuple(f"{side}_knuckle" for side in sides)),
        flexion=np.array(flexion, dtype=np.int64),
        reference=np.array(reference, order="C"),
        points=np.array(learned.centers_, order="C"),
        smoother=smoother,
        metric=metric,
        field=middle,
        directions=np.array(learned.directions_[:, 0], order="C"),
        ends=np.stack([learned.lower_[:, 0], learned.upper_[:, 0]]),
    )
