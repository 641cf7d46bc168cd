"""Which axis of the laboratory points up, as the trunk of a person shows it."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.motion.motion import Motion
from ikns.numerics.rigid import quaternion_matrix

#: A trunk is upright when its long axis is within 37 deg of an axis of the laboratory,
#: and the laboratory's vertical is known when the trunk is so in most of the frames.
_UPRIGHT, _MOST = 0.8, 0.9


def lab_vertical(motion: Motion) -> Array | None:
    """Return the axis of the laboratory that points up.

    Parameters
    ----------
    motion : Motion
        Of somebody who stands or sits, best a static trial.

    Returns
    -------
    (3,) array or None
        A unit vector along an axis, such as ``[0, 0, 1]``; None where the trunk is not
        upright in most frames, or not always the same way up.
    """
    up = quaternion_matrix(motion.thorax_in_world[:, 3:])[:, :, 1]  # its y points up
    up = up[np.isfinite(up).all(axis=1)]
    if not len(up):
        return None
    shares = np.concatenate(
        [(up > _UPRIGHT).mean(axis=0), (up < -_UPRIGHT).mean(axis=0)]
    )
    best = int(shares.argmax())
    if shares[best] < _MOST:
        return None
    axis = np.zeros(3)
    axis[best % 3] = 1.0 if best < 3 else -1.0
    return axis


def up_sentence(up: Array | None, *, model: bool) -> str:
    """Say what OpenSim, whose Y is up, makes of another vertical; empty if the same.

    `model` says whether the body was written as a model, too.
    """
    if up is None:
        unknown = (
            "which way is up is not known, as the trunk is not upright along an axis "
            "of the laboratory; Y is up in OpenSim"
        )
        return f"{unknown}, and so it is for the gravity of the model." * model
    if up[1] > 0:
        return ""
    axis = ("-" if up.min() < 0 else "") + "XYZ"[int(np.abs(up).argmax())]
    gravity = f"; the model's gravity is along {_opposite(axis)}" if model else ""
    return (
        f"{axis} is up in the laboratory and Y in OpenSim, so the person lies there"
        f"{gravity}."
    )


def _opposite(axis: str) -> str:
    return axis[1:] if axis.startswith("-") else f"-{axis}"
