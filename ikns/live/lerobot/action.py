"""From the control signal to an action: values by the names of a robot's joints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ikns.errors import InvalidInput

#: Names of the signals themselves in an action.
SIGNALS = ("c", "flexion")


def check_joints(joints: Mapping[str, Sequence[float]]) -> None:
    """Check that each joint has two finite values.

    Raises
    ------
    InvalidInput
        When one has not.
    """
    for name, ends in joints.items():
        if len(ends) != 2 or not all(map(math.isfinite, ends)):
            raise InvalidInput(
                f"expected two finite values for {name}, at flexion 0 and 1, found "
                f"{', '.join(f'{end:g}' for end in ends) or 'none'}."
            )


def action_names(joints: Mapping[str, Sequence[float]]) -> tuple[str, ...]:
    """Return the names in an action: the joints or, without any, the signals."""
    return tuple(joints) or SIGNALS


def action(
    c: float, flexion: float, joints: Mapping[str, Sequence[float]]
) -> dict[str, float]:
    """Return an action.

    Parameters
    ----------
    c : float
        Control signal, clipped to 0 to 1 here.
    flexion : float
        0 to 1.
    joints : mapping
        Values of each joint at flexion 0 and 1, in the robot's units; equal for a joint
        that does not move.

    Returns
    -------
    dict of float
        The joints or, without any, ``c`` and ``flexion``.

    Examples
    --------
    >>> action(0.3, 0.25, {"gripper.pos": [100.0, 0.0]})
    {'gripper.pos': 75.0}
    >>> action(1.2, 0.25, {})
    {'c': 1.0, 'flexion': 0.25}
    """
    if not joints:
        return {"c": min(max(c, 0.0), 1.0), "flexion": flexion}
    # Weighted, so that the ends are met exactly.
    return {
        name: (1.0 - flexion) * at_0 + flexion * at_1
        for name, (at_0, at_1) in joints.items()
    }
