r"""Geometry of the simulated finger: six modules that a tendon flexes equally.

The finger lies over a flat palm, with its base at the wrist, and curls towards the
palm. The distance of its tip from the palm is its opening:

.. math:: w(f) = h - l \sum_{i=1}^{6} \sin(i f \theta)

with module length :math:`l`, full flexion :math:`\theta` of a module, and the base's
height :math:`h` such that the tip touches the palm at f = 1. Beyond 20.5 degrees the
tip would rise again, so :math:`\theta` = 20 degrees.

All dimensions are assumptions, as the paper gives none. The modules together are as
long as the four modules of about 40 mm of the fingers that the paper builds on, and the
finger opens to 117 mm, so that the paper's objects of 50 to 97 mm fit.
"""

from __future__ import annotations

import math

from ikns.errors import InvalidInput

MODULES = 6
MODULE_LENGTH = 0.025  # m
FULL_FLEXION = math.radians(20)  # of each module


def _drop(flexion: float) -> float:
    """Distance of the tip below the base, m."""
    angle = flexion * FULL_FLEXION
    return MODULE_LENGTH * sum(math.sin(i * angle) for i in range(1, MODULES + 1))


#: Height of the base above the palm, and opening at flexion 0, m.
WIDEST = _drop(1.0)


def joint_angles(flexion: float) -> tuple[float, ...]:
    """Angles of the modules from base to tip, rad.

    >>> [round(math.degrees(angle)) for angle in joint_angles(0.5)]
    [10, 10, 10, 10, 10, 10]
    """
    return (flexion * FULL_FLEXION,) * MODULES


def opening(flexion: float) -> float:
    """Distance between tip and palm, m.

    >>> round(opening(0.0), 3), round(opening(1.0), 3)
    (0.117, 0.0)
    """
    return WIDEST - _drop(flexion)


def flexion_at(width: float) -> float:
    """Flexion at which the finger touches an object of this width, m.

    Raises
    ------
    InvalidInput
        When such an object does not fit.

    Examples
    --------
    >>> round(opening(flexion_at(0.06)), 9)
    0.06
    """
    if not 0.0 < width <= WIDEST:
        raise InvalidInput(
            f"an object of {1000 * width:g} mm does not fit, the finger opens to "
            f"{1000 * WIDEST:.0f} mm."
        )
    low, high = 0.0, 1.0
    for _ in range(
        60
    ):  # bisection down to rounding; the opening decreases monotonically
        middle = (low + high) / 2
        low, high = (middle, high) if opening(middle) > width else (low, middle)
    return low
