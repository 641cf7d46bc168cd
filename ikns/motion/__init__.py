"""Joints over time: marker inverse kinematics, and reported joint angles."""
