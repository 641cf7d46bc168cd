"""Pinocchio's model as arrays for the kernels: exported once, then only read."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ikns._kernels.body.tree import FREE_FLYER, PRISMATIC, REVOLUTE, Tree
from ikns.arrays import Array

__all__ = ["joint_tree"]


def joint_tree(model: pin.Model) -> tuple[Tree, Array]:
    """Export a model whose joints are revolute, prismatic or free flyers.

    Joint i of the tree is joint i + 1 of the model. Also returns the rotation from a
    tree joint's frame, whose axis is z, to the model joint's frame, (J, 3, 3).
    """
    joints = list(model.joints)[1:]
    kinds, turned = [], np.empty((len(joints), 3, 3))
    for i, joint in enumerate(joints):
        kind, axis = _kind_and_axis(joint)
        kinds.append(kind)
        turned[i] = _turn_to(axis)
    parent = np.array([model.parents[i + 1] - 1 for i in range(len(joints))])
    rotation, translation = np.empty((len(joints), 3, 3)), np.empty((len(joints), 3))
    for i, above in enumerate(parent):
        placement = model.jointPlacements[i + 1]
        carrier = np.eye(3) if above < 0 else turned[above]
        rotation[i] = carrier.T @ placement.rotation @ turned[i]
        translation[i] = carrier.T @ placement.translation
    first_v = np.array([joint.idx_v for joint in joints])
    dof_parent = np.empty(model.nv, dtype=np.int64)
    for i, joint in enumerate(joints):
        above = -1
        if parent[i] >= 0:
            carrier_joint = joints[parent[i]]
            above = carrier_joint.idx_v + carrier_joint.nv - 1
        for k in range(joint.nv):
            dof_parent[joint.idx_v + k] = above if k == 0 else joint.idx_v + k - 1
    tree = Tree(
        kind=np.array(kinds, dtype=np.int64),
        parent=parent.astype(np.int64),
        first_q=np.array([joint.idx_q for joint in joints], dtype=np.int64),
        first_v=first_v.astype(np.int64),
        rotation=rotation,
        translation=translation,
        dof_parent=dof_parent,
    )
    return tree, turned


def _kind_and_axis(joint: pin.JointModel) -> tuple[int, Array]:
    if joint.nq == 7:
        return FREE_FLYER, np.array([0.0, 0.0, 1.0])
    data = joint.createData()
    joint.calc(data, np.zeros(1))
    linear, angular = np.split(np.array(data.S).ravel(), 2)
    return (REVOLUTE, angular) if angular.any() else (PRISMATIC, linear)


def _turn_to(axis: Array) -> Array:
    """Rotation whose z axis is `axis`."""
    z = axis / np.linalg.norm(axis)
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x -= z * (x @ z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
