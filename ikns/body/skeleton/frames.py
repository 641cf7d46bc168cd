"""Poses and Jacobians of links in the thorax frame, by compiled kernels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ikns._kernels.body.elbow import write_swivels
from ikns._kernels.body.paths import Paths, place_frames, write_jacobians
from ikns._kernels.body.tree import Tree
from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, as_chain
from ikns.body.skeleton.model import joint_tree
from ikns.errors import FileError, InvalidInput


class LinkFrames:
    """The links of a model, as in :func:`joint_tree`; joint 0 carries the thorax."""

    def __init__(self, model: pin.Model) -> None:
        self._model = model
        self.tree: Tree
        self.tree, self.turned = joint_tree(model)
        self.joint_names: tuple[str, ...] = tuple(model.names)[2:]
        self._cache: dict[tuple[tuple[str, ...], tuple[str, ...], str], Paths] = {}

    def index(self, link: str) -> int:
        """Return the index of a link's frame in the model."""
        # Pinocchio returns the number of frames for an unknown name.
        index = self._model.getFrameId(link, pin.FrameType.BODY)
        if index >= self._model.nframes:
            raise FileError(f"the URDF has no link '{link}'.")
        return int(index)

    def in_tree(self, link: str) -> tuple[int, Array, Array]:
        """Joint of the tree that carries a link, and the link's pose in its frame."""
        frame = self._model.frames[self.index(link)]
        joint = frame.parentJoint - 1
        back = self.turned[joint].T
        pose = frame.placement
        return joint, back @ pose.rotation, back @ pose.translation

    def place(
        self, q: ArrayLike, links: Sequence[str], base: str = "thorax"
    ) -> tuple[Array, Array]:
        """Origins (..., E, 3) m and orientations (..., E, 3, 3) of E links."""
        angles, batch = self._angles(q)
        position = np.empty((len(angles), len(links), 3))
        rotation = np.empty((*position.shape, 3))
        place_frames(self.paths(tuple(links), (), base), angles, rotation, position)
        shape = (*batch, *position.shape[1:])
        return position.reshape(shape), rotation.reshape(*shape, 3)

    def jacobian(self, q: ArrayLike, chain: ChainLike, task: str) -> Array:
        """Jacobians of a chain's ends, (..., k, n)."""
        own = as_chain(chain)
        return self.jacobian_of(q, own.ends, own.joints, task, base=own.base)

    def jacobian_of(
        self,
        q: ArrayLike,
        links: tuple[str, ...],
        joints: tuple[str, ...],
        task: str,
        *,
        base: str = "thorax",
    ) -> Array:
        """Jacobians of links by joints, (..., k, n)."""
        if task not in ("pose", "position"):
            raise InvalidInput(f"task must be 'pose' or 'position', not '{task}'.")
        rows = 6 if task == "pose" else 3
        angles, batch = self._angles(q)
        jacobian = np.zeros((len(angles), rows * len(links), len(joints)))
        write_jacobians(self.paths(links, joints, base), angles, rows, jacobian)
        return jacobian.reshape(*batch, *jacobian.shape[1:])

    @cached_property
    def elbow_paths(self) -> Paths:
        """Paths to the right and left shoulder, then the elbows, then the wrists."""
        ends = ("upper_arm", "forearm", "hand")
        return self.paths(tuple(f"{side}_{end}" for end in ends for side in SIDES))

    def swivel(self, q: ArrayLike) -> Array:
        """Elbow angle about the line from shoulder to wrist, (..., 2) rad."""
        angles, batch = self._angles(q)
        swivels = np.empty((len(angles), len(SIDES)))
        write_swivels(self.elbow_paths, angles, swivels)
        return swivels.reshape(*batch, len(SIDES))

    def _angles(self, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
        """Joint angles as rows, and the shape of the batch."""
        array, n = np.asarray(q, dtype=np.float64), len(self.joint_names)
        if not array.ndim or array.shape[-1] not in (n, n + 7):
            raise InvalidInput(
                f"expected configurations (..., {n + 7}) or joint angles (..., {n}), "
                f"found an array {array.shape}."
            )
        # A copy, as the kernels are compiled for arrays that can be written.
        return np.array(array[..., -n:], order="C").reshape(-1, n), array.shape[:-1]

    def paths(
        self,
        links: tuple[str, ...],
        columns: tuple[str, ...] = (),
        base: str = "thorax",
    ) -> Paths:
        """Paths from the base, by default the thorax, to the links; computed once.

        `columns` are the joints of a Jacobian's columns.
        """
        key = links, columns, base
        if key not in self._cache:
            self._cache[key] = self._paths_to(*key)
        return self._cache[key]

    def _paths_to(
        self, links: tuple[str, ...], columns: tuple[str, ...], base: str
    ) -> Paths:
        if base != "thorax":
            return self._paths_from(base, links, columns)
        tree, ends = self.tree, [self.in_tree(link) for link in links]
        moving = [self.joints_to(joint) for joint, _, _ in ends]
        joints = np.array(sum(moving, []), dtype=np.int64)
        names = [self.joint_names[joint - 1] for joint in joints]
        column = np.array(
            [columns.index(name) if name in columns else -1 for name in names],
            dtype=np.int64,
        )
        return Paths(
            ends=np.cumsum([len(joints) for joints in moving]),
            joint=np.stack([tree.kind[joints], joints - 1, column], axis=1),
            rotation=np.stack([*tree.rotation[joints], *(R for _, R, _ in ends)]),
            translation=np.stack([*tree.translation[joints], *(p for _, _, p in ends)]),
        )

    def _paths_from(
        self, base: str, links: tuple[str, ...], columns: tuple[str, ...]
    ) -> Paths:
        """Paths from another link than the thorax, on the way to the links."""
        start, turn, shift = self.in_tree(base)
        above = self.joints_to(start)
        whole = self._paths_to(links, columns, "thorax")
        first = np.r_[0, whole.ends[:-1]]
        kept = np.ones(len(whole.joint), dtype=bool)
        rotation, translation = whole.rotation.copy(), whole.translation.copy()
        for link, begin in zip(links, first, strict=True):
            way = self.joints_to(self.in_tree(link)[0])
            if way[: len(above)] != above or len(way) == len(above):
                raise InvalidInput(
                    f"the link '{link}' does not move against '{base}'; expected a "
                    "base between the thorax and the ends."
                )
            kept[begin : begin + len(above)] = False
            k = begin + len(above)
            # The first joint's placement, seen from the base and not from its joint.
            translation[k] = turn.T @ (translation[k] - shift)
            rotation[k] = turn.T @ rotation[k]
        placed = np.r_[kept, np.ones(len(links), dtype=bool)]
        return Paths(
            ends=whole.ends - len(above) * np.arange(1, len(links) + 1),
            joint=whole.joint[kept],
            rotation=rotation[placed],
            translation=translation[placed],
        )

    def joints_to(self, joint: int) -> list[int]:
        """Joints of the tree from the thorax to this one, without the thorax's own."""
        parent = int(self.tree.parent[joint])
        return [] if parent < 0 else [*self.joints_to(parent), joint]
