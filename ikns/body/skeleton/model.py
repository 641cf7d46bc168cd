"""Pinocchio's model of a URDF, checked, and exported as arrays for the kernels."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from ikns._kernels.body.tree import FREE_FLYER, PRISMATIC, REVOLUTE, Tree
from ikns.arrays import Array
from ikns.body.chains import SIDES, chain_joints
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton.urdf import parse_urdf
from ikns.errors import FileError, unreadable
from ikns.numerics.rigid import turn_to

#: Columns of a configuration and of its tangent that hold the free flyer.
NQ_ROOT, NV_ROOT = 7, 6


def read_urdf(path: Path) -> str:
    """Read the text of a URDF file."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise unreadable(path, error, "a URDF") from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: this is not a text file (byte {error.start} is no UTF-8); a URDF "
            "is one."
        ) from None


def build_model(urdf: str) -> pin.Model:
    """Build the model of a URDF whose root link gets a free flyer."""
    parse_urdf(urdf)
    try:
        return pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().rstrip(".")
        raise FileError(f"the URDF cannot be read: {reason}.") from None


@lru_cache(maxsize=8)
def upper_body_model(urdf: str) -> pin.Model:
    """Build the model of an upper body; other links and joints are a FileError.

    No one changes it, so bodies that differ in their markers share it.
    """
    model = build_model(urdf)
    joints = set(tuple(model.names)[2:])
    bodies = {f.name for f in model.frames if f.type == pin.FrameType.BODY}
    needed = {j for side in SIDES for j in chain_joints(f"{side}_arm_clavicle")}
    needed |= {*SEGMENTS, *(f"{side}_knuckle" for side in SIDES)}
    missing = needed - joints - bodies
    if missing or model.nq != NQ_ROOT + len(joints):
        raise FileError(
            "the URDF is not an upper body of revolute joints: it lacks "
            f"{', '.join(sorted(missing)) or 'one-angle joints'}."
        )
    return model


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
        turned[i] = turn_to(axis)
    parent = np.array([model.parents[i + 1] - 1 for i in range(len(joints))])
    rotation, translation = np.empty((len(joints), 3, 3)), np.empty((len(joints), 3))
    for i, above in enumerate(parent):
        placement = model.jointPlacements[i + 1]
        carrier = np.eye(3) if above < 0 else turned[above]
        rotation[i] = carrier.T @ placement.rotation @ turned[i]
        translation[i] = carrier.T @ placement.translation
    first_v = np.array([joint.idx_v for joint in joints])
    tree = Tree(
        kind=np.array(kinds, dtype=np.int64),
        parent=parent.astype(np.int64),
        first_q=np.array([joint.idx_q for joint in joints], dtype=np.int64),
        first_v=first_v.astype(np.int64),
        rotation=rotation,
        translation=translation,
    )
    return tree, turned


def _kind_and_axis(joint: pin.JointModel) -> tuple[int, Array]:
    if joint.nq == 7:
        return FREE_FLYER, np.array([0.0, 0.0, 1.0])
    data = joint.createData()
    joint.calc(data, np.zeros(1))
    linear, angular = np.split(np.array(data.S).ravel(), 2)
    return (REVOLUTE, angular) if angular.any() else (PRISMATIC, linear)
