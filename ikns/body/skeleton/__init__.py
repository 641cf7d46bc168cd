"""Bodies and robots from a URDF; sole owner of Pinocchio's model."""

from ikns.body.skeleton.chain_check import check_chain
from ikns.body.skeleton.robot import Robot
from ikns.body.skeleton.skeleton import Skeleton

__all__ = ["Robot", "Skeleton", "check_chain"]
