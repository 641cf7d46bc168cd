"""Bodies and robots from a URDF; sole owner of Pinocchio's model."""

from ikns.skeleton.robot import Robot
from ikns.skeleton.skeleton import Skeleton

__all__ = ["Robot", "Skeleton"]
