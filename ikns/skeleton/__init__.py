"""The skeleton: a person's URDF and markers; sole owner of Pinocchio's model."""

from ikns.skeleton.skeleton import Skeleton

__all__ = ["Skeleton"]
