"""Pinocchio's model of a URDF, and the check that it is an upper body."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin

from ikns.body.chains import SIDES, chain_joints
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton.urdf import parse_urdf
from ikns.errors import FileError

__all__ = ["NQ_ROOT", "NV_ROOT", "build_model", "read_urdf", "upper_body_model"]

#: Columns of a configuration and of its tangent that hold the free flyer.
NQ_ROOT, NV_ROOT = 7, 6


def read_urdf(path: Path) -> str:
    """Read the text of a URDF file.

    Raises
    ------
    FileError
        When the file cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(f"{path}: cannot be read as a URDF: {reason}.") from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: expected a URDF as text in UTF-8, found other bytes at "
            f"{error.start}."
        ) from None


def build_model(urdf: str) -> pin.Model:
    """Build the model of a URDF whose root link gets a free flyer.

    Raises
    ------
    FileError
        When the text is not a URDF.
    """
    parse_urdf(urdf)
    try:
        return pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().rstrip(".")
        raise FileError(f"the URDF cannot be read: {reason}.") from None


def upper_body_model(urdf: str) -> pin.Model:
    """Build the model of an upper body.

    Raises
    ------
    FileError
        When the text is not a URDF, lacks a link or joint of the upper body, or has
        joints other than revolute ones.
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
