"""Any robot from its URDF: the joints from its base to one frame.

Learning and analysis need joint angles, a hand and a Jacobian, nothing else, so a robot
arm can take the place of a person's.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ikns._kernels.body.tree import Tree
from ikns.arrays import Array, Indices
from ikns.body.skeleton.frames import LinkFrames
from ikns.body.skeleton.model import build_model, read_urdf
from ikns.body.skeleton.urdf import parse_urdf
from ikns.errors import InvalidInput, naming
from ikns.numerics.subspace import null_spaces

#: How many of a robot's links an error names.
_NAMED = 12


class Robot:
    """The kinematics of a robot from its base to one of its links.

    Parameters
    ----------
    urdf : str
        URDF text. Meshes it names are not opened.
    frame : str
        The link that does the task.

    Attributes
    ----------
    frame : str
    joint_names : tuple of str
        The n movable joints from the base to the frame, in this order; others are left
        out.
    lower, upper : (n,) array
        Limits, rad (m for prismatic joints); infinite for continuous joints.

    Raises
    ------
    FileError
        When the text is not a URDF.
    InvalidInput
        When it has no such link, or no joint moves it, or one that does is neither
        revolute nor prismatic.

    Examples
    --------
    >>> urdf = '''<robot name="planar"><link name="base"/><link name="arm"/>
    ...   <joint name="turn" type="continuous"><parent link="base"/>
    ...   <child link="arm"/><axis xyz="0 0 1"/></joint><link name="tip"/>
    ...   <joint name="end" type="fixed"><parent link="arm"/><child link="tip"/>
    ...   <origin xyz="2 0 0"/></joint></robot>'''
    >>> robot = Robot(urdf, "tip")
    >>> robot.pose([np.pi / 2])[0].round(6)
    array([0., 2., 0.])
    """

    def __init__(self, urdf: str, frame: str) -> None:
        text, continuous, refused = _with_one_angle_a_joint(urdf)
        model = build_model(text)
        links = [f.name for f in model.frames if f.type == pin.FrameType.BODY]
        if frame not in links:
            more = ", ..." if len(links) > _NAMED else ""
            raise InvalidInput(
                f"the robot '{model.name}' has no link '{frame}', but "
                f"{', '.join(links[:_NAMED])}{more}."
            )
        self.frame = frame
        self._frames = LinkFrames(model)
        carrier, rotation, translation = self._frames.in_tree(frame)
        self.end: tuple[int, Array, Array] = (carrier, rotation, translation)
        moving = self._frames.joints_to(carrier)
        self.joint_names: tuple[str, ...] = tuple(model.names[j + 1] for j in moving)
        unfit = [name for name in self.joint_names if name in refused]
        if unfit or not moving:
            found = f"joint '{unfit[0]}'" if unfit else "none"
            raise InvalidInput(
                f"expected revolute or prismatic joints from the base to '{frame}', "
                f"found {found}."
            )
        kinds = {
            name: joint.shortname()
            for name, joint in zip(model.names, model.joints, strict=True)
        }
        self.sliding: tuple[str, ...] = tuple(
            name for name in self.joint_names if kinds[name].startswith("JointModelP")
        )
        columns = np.array([model.joints[j + 1].idx_q for j in moving])
        free = np.isin(self.joint_names, list(continuous))
        self.lower: Array = np.where(free, -np.inf, model.lowerPositionLimit[columns])
        self.upper: Array = np.where(free, np.inf, model.upperPositionLimit[columns])
        self._places = np.array(
            [self._frames.joint_names.index(name) for name in self.joint_names]
        )

    @classmethod
    def load(cls, path: str | Path, frame: str) -> Robot:
        """Read a URDF file; `frame` is the link that does the task."""
        with naming(str(path)):
            return cls(read_urdf(Path(path)), frame)

    @property
    def tree(self) -> Tree:
        """All joints; joint 0 is a free flyer that carries the base."""
        return self._frames.tree

    def pose(self, q: ArrayLike) -> tuple[Array, Array]:
        """Frame seen from the base at joint positions (..., n), rad or m.

        Returns its position (..., 3), m, and rotation (..., 3, 3).
        """
        position, rotation = self._frames.place(self._all(q), (self.frame,))
        return position[..., 0, :], rotation[..., 0, :, :]

    def jacobian(self, q: ArrayLike, *, task: str = "pose") -> Array:
        """Jacobian of the frame seen from the base, (..., 6, n) or (..., 3, n).

        Parameters
        ----------
        q : (..., n) array
            Joint positions, rad or m.
        task : {"pose", "position"}
            Rows: linear velocity (m/rad), and for ``"pose"`` angular velocity below.
        """
        return self._frames.jacobian_of(
            self._all(q), (self.frame,), self.joint_names, task
        )

    def null_spaces(
        self, q: ArrayLike, *, task: str = "pose", rtol: float = 1e-9
    ) -> tuple[Array, Indices]:
        """Joint motions that leave the frame where it is.

        Returns
        -------
        basis : (..., d, n) array
            Orthonormal rows, see :func:`ikns.numerics.subspace.null_spaces`.
        rank : (...) integer array
            Of the Jacobian; -1 where it is not finite.
        """
        return null_spaces(self.jacobian(q, task=task), rtol=rtol)

    def _all(self, q: ArrayLike) -> Array:
        """Positions of all joints; those that do not move the frame are zero."""
        given = np.asarray(q, dtype=np.float64)
        n = len(self.joint_names)
        if not given.ndim or given.shape[-1] != n:
            raise InvalidInput(
                f"expected positions (..., {n}) of {', '.join(self.joint_names)}, "
                f"found an array {given.shape}."
            )
        every = np.zeros((*given.shape[:-1], len(self._frames.joint_names)))
        every[..., self._places] = given
        return every


def _with_one_angle_a_joint(urdf: str) -> tuple[str, set[str], set[str]]:
    """Text whose joints all have one position, and which were continuous or refused.

    Pinocchio stores a continuous joint as cosine and sine; here it is an angle. A
    floating or planar joint becomes revolute, and is refused where it moves the frame.
    """
    robot = parse_urdf(urdf)
    for link in robot.findall("link"):
        # Neither shapes nor masses change the kinematics.
        link[:] = []
    continuous, refused = set(), set()
    for joint in robot.iter("joint"):
        name, kind = joint.get("name", ""), joint.get("type")
        if kind == "continuous":
            continuous.add(name)
        elif kind in ("floating", "planar"):
            refused.add(name)
        else:
            continue
        joint.set("type", "revolute")
        for old in joint.findall("limit"):
            joint.remove(old)
        ET.SubElement(joint, "limit", lower="-1", upper="1", effort="1", velocity="1")
    return ET.tostring(robot, encoding="unicode"), continuous, refused
