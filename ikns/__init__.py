"""Intrinsic kinematic null space: learned from a person, driving a wearable robot."""

__version__ = "0.1.0"
