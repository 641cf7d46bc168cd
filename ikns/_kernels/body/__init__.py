"""Compiled kernels of the body: kinematics, marker inverse kinematics, frames."""
