"""The null-space map: learned from still samples or computed from the Jacobian.

The method is in `estimator`; the signs of directions are in `alignment`, the selection
of still samples in `samples`, and the map without learning in `analytic`.
"""

from ikns.nullspace.map.analytic import analytic_map
from ikns.nullspace.map.checks import MapWarning
from ikns.nullspace.map.estimator import NullSpaceMap
from ikns.nullspace.map.samples import (
    held_angles,
    held_frame,
    null_space_samples,
    robot_null_space_samples,
    still_mask,
)

__all__ = [
    "MapWarning",
    "NullSpaceMap",
    "analytic_map",
    "held_angles",
    "held_frame",
    "null_space_samples",
    "robot_null_space_samples",
    "still_mask",
]
