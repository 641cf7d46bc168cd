"""Marker inverse kinematics: the joint angles that put markers where they were seen.

The formula is in `solver`; `reference` solves it plainly, `kernel` compiled.
"""

from ikns.motion.marker_ik.pose import LIMIT, PRIOR, Pose
from ikns.motion.marker_ik.solver import MarkerIK

__all__ = ["LIMIT", "PRIOR", "MarkerIK", "Pose"]
