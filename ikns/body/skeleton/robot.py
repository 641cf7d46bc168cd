"""Any robot from its URDF: the joints from its base to one frame.

Learning and analysis need joint angles, a hand and a Jacobian, nothing else, so a robot
arm can take the place of a person's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ikns._kernels.body.tree import REVOLUTE, Tree
from ikns.arrays import Array, Indices, Mask
from ikns.body.skeleton.frames import LinkFrames
from ikns.body.skeleton.model import build_model, read_urdf
from ikns.body.skeleton.robot_urdf import Mimic, prepared, some
from ikns.errors import InvalidInput, naming
from ikns.numerics.subspace import null_spaces


class Robot:
    """The kinematics of a robot from its base to one of its links.

    A joint that mimics another is not a degree of freedom: it moves with the joint that
    it follows, which counts as a joint of the robot even if it is not between base and
    frame.

    Parameters
    ----------
    urdf : str
        URDF text. Meshes it names are not opened.
    frame : str
        The link that does the task.
    base : str, optional
        The link where the chain starts, such as a torso; poses are seen from it.
        Default: the root of the URDF.

    Attributes
    ----------
    frame : str
    joint_names : tuple of str
        The n movable joints from the base to the frame, in this order; others are left
        out.
    lower, upper : (n,) array
        Limits, rad (m for prismatic joints); infinite for continuous joints.
    revolute : (n,) boolean array
        Whether a joint's position is an angle that means the same a full turn later.
    endless : (n,) boolean array
        Which of these can make a full turn.
    coupling : (p, n) array
        Positions of the p joints on the way are ``coupling @ q`` and the offsets of
        those that mimic others; the identity where none does.

    Raises
    ------
    FileError
        When the text is not a URDF.
    InvalidInput
        When it has no such link, or the base is not on the way to it, or no joint moves
        it, or one that does is neither revolute nor prismatic.

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

    def __init__(self, urdf: str, frame: str, *, base: str | None = None) -> None:
        text = prepared(urdf, base=base)
        model = build_model(text.urdf)
        links = [f.name for f in model.frames if f.type == pin.FrameType.BODY]
        if frame not in links:
            start = "" if base is None else f" on '{base}'"
            raise InvalidInput(
                f"the robot '{model.name}' has no link '{frame}'{start}, but "
                f"{some(links)}."
            )
        self.frame = frame
        self._frames = LinkFrames(model)
        carrier, rotation, translation = self._frames.in_tree(frame)
        self.end: tuple[int, Array, Array] = (carrier, rotation, translation)
        names = [model.names[j + 1] for j in self._frames.joints_to(carrier)]
        leading = [text.mimics.get(name, Mimic(name, 1.0, 0.0)) for name in names]
        self.joint_names: tuple[str, ...] = tuple(
            dict.fromkeys(mimic.leader for mimic in leading)
        )
        unfit = [n for n in (*names, *self.joint_names) if n in text.refused]
        if unfit or not names:
            found = f"joint '{unfit[0]}'" if unfit else "none"
            raise InvalidInput(
                f"expected revolute or prismatic joints from the base to '{frame}', "
                f"found {found}."
            )
        self.coupling: Array = np.zeros((len(names), len(self.joint_names)))
        for row, mimic in zip(self.coupling, leading, strict=True):
            row[self.joint_names.index(mimic.leader)] = mimic.factor
        self._offsets = np.array([mimic.offset for mimic in leading])
        self._way, self._alone = tuple(names), not set(names) & set(text.mimics)
        self._places = np.array([self._frames.joint_names.index(n) for n in names])
        ids = [model.getJointId(name) for name in self.joint_names]
        columns = np.array([model.joints[j].idx_q for j in ids])
        free = np.isin(self.joint_names, list(text.continuous))
        self.lower: Array = np.where(free, -np.inf, model.lowerPositionLimit[columns])
        self.upper: Array = np.where(free, np.inf, model.upperPositionLimit[columns])
        kinds = self.tree.kind[
            [model.getJointId(name) - 1 for name in self.joint_names]
        ]
        self.sliding: tuple[str, ...] = tuple(
            np.array(self.joint_names)[kinds != REVOLUTE]
        )
        # A full turn of a leader must be full turns of all that follow it.
        whole = (self.coupling == self.coupling.round()).all(axis=0)
        self.revolute: Mask = np.asarray((kinds == REVOLUTE) & whole)
        turn = 2 * np.pi * (1 - 1e-3)  # URDF files round pi
        self.endless: Mask = self.revolute & (self.upper - self.lower >= turn)

    @classmethod
    def load(cls, path: str | Path, frame: str, *, base: str | None = None) -> Robot:
        """Read a URDF file; `frame` is the link that does the task."""
        with naming(str(path)):
            return cls(read_urdf(Path(path)), frame, base=base)

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
        on_the_way = self._frames.jacobian_of(
            self._all(q), (self.frame,), self._way, task
        )
        return on_the_way if self._alone else on_the_way @ self.coupling

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
        on_the_way = given if self._alone else given @ self.coupling.T + self._offsets
        every[..., self._places] = on_the_way
        return every
