"""Marker inverse kinematics: the joint angles that put markers where they were seen."""

from ikns.marker_ik.reference import LIMIT, PRIOR, MarkerIK, Pose, motion_from_poses

__all__ = ["LIMIT", "PRIOR", "MarkerIK", "Pose", "motion_from_poses"]
