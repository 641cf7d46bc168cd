"""Marker inverse kinematics: the joint angles that put markers where they were seen.

The formula is in `solver`; `kernel` hands it to compiled code.
"""

from ikns.motion.marker_ik.pose import LIMIT, PRIOR, Pose
from ikns.motion.marker_ik.solver import MarkerIK
from ikns.motion.marker_ik.turns import turned_markers

__all__ = ["LIMIT", "PRIOR", "MarkerIK", "Pose", "turned_markers"]
