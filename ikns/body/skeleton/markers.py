"""Markers on the joints of Pinocchio's model: their positions and derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin

from ikns.arrays import Array, Mask
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS, segment_ends
from ikns.errors import MarkerMismatch


class Markers:
    """M markers, given in link frames, fixed to the joints of a model."""

    def __init__(self, model: pin.Model, marker_set: MarkerSet) -> None:
        links = {f.name: f for f in model.frames if f.type == pin.FrameType.BODY}
        unknown = [m for m in marker_set.markers if m.link not in links]
        if unknown:
            raise MarkerMismatch(
                f"marker {unknown[0].label} sits on link '{unknown[0].link}', "
                "which the URDF does not have."
            )
        frames = [links[m.link] for m in marker_set.markers]
        self._model, self._data = model, model.createData()
        self._carrier = {link: links[link].parentJoint for link in SEGMENTS}
        self.joint = np.array([f.parentJoint for f in frames], dtype=np.int64)
        self.in_joint = np.array(
            [
                f.placement.act(np.array(m.position))
                for f, m in zip(frames, marker_set.markers, strict=True)
            ]
        ).reshape(-1, 3)
        joints, self._row = np.unique(self.joint, return_inverse=True)
        self._joints: list[int] = joints.tolist()
        self._carried = []
        for joint in joints:
            rows = np.flatnonzero(self.joint == joint)
            self._carried.append((rows, self.in_joint[rows]))

    @cached_property
    def _beyond(self) -> list[Mask]:
        """Which markers (M,) each joint moves."""
        return [np.isin(self.joint, list(subtree)) for subtree in self._model.subtrees]

    @cached_property
    def _moves(self) -> Array:
        """1 where a rate moves a marker, else 0, (M, nv)."""
        model = self._model
        moves = np.zeros((len(self.joint), model.nv))
        for row, joint in zip(moves, self.joint, strict=True):
            for ancestor in model.supports[int(joint)][1:]:
                start = model.idx_vs[ancestor]
                row[start : start + model.nvs[ancestor]] = 1.0
        return moves

    def place(self, q: Array) -> Array:
        """Positions in the world, (..., M, 3) m, at configurations (..., nq)."""
        return self._positions(*self._poses(q, self._joints))

    def jacobian(self, q: Array) -> tuple[Array, Array]:
        """Positions (..., M, 3) m, and derivatives by the tangent, (..., M, 3, nv).

        Column j is ``linear_j + angular_j x position`` for the joints between the root
        and the marker, else zero.
        """
        nv = self._model.nv
        twists = np.empty((*q.shape[:-1], 2, 3, 1, nv))
        positions = self._positions(*self._poses(q, self._joints, twists=twists))
        x, y, z = np.moveaxis(positions[..., None], -2, 0)
        linear = np.moveaxis(twists[..., 0, :, :, :], -3, 0)
        wx, wy, wz = np.moveaxis(twists[..., 1, :, :, :], -3, 0)
        jacobian = np.empty((*positions.shape, nv))
        jacobian[..., 0, :] = linear[0] + wy * z - wz * y
        jacobian[..., 1, :] = linear[1] + wz * x - wx * z
        jacobian[..., 2, :] = linear[2] + wx * y - wy * x
        jacobian *= self._moves[:, None, :]
        return positions, jacobian

    def by_size(self, q: Array, along: Array) -> tuple[Array, Array]:
        """Differentiate by the log sizes, (..., M, 3, S), and the marker places.

        The latter is (..., M, 3, 3). `along` (M, 3) is the part of each marker's
        position that scales with its segment, in the joint's frame, m.
        """
        model = self._model
        carriers = [self._carrier[segment] for segment in SEGMENTS]
        rotation = self._poses(q, carriers + self._joints)[0]
        by_size = np.zeros((*q.shape[:-1], len(self.joint), 3, len(SEGMENTS)))
        for s, carrier in enumerate(carriers):
            turned, by = rotation[..., s, :, :], by_size[..., s]
            for joint in model.children[carrier]:
                way = turned @ model.jointPlacements[joint].translation
                by[..., self._beyond[joint], :] = way[..., None, :]
            own = self.joint == carrier
            by[..., own, :] = along[own] @ np.swapaxes(turned, -1, -2)
        return by_size, rotation[..., len(SEGMENTS) + self._row, :, :]

    def by_tilt(self, q: Array, tilts: Sequence[tuple[str, int]]) -> Array:
        """Differentiate by tilts of joints, (..., M, 3, K) m/rad.

        A tilt is a joint and the axis of its frame, 0 to 2, about which it turns before
        it moves.
        """
        model = self._model
        joints = [model.getJointId(name) for name, _ in tilts]
        rotation, translation = self._poses(
            q, [model.parents[joint] for joint in joints]
        )
        before = [model.jointPlacements[joint] for joint in joints]
        axes = np.array(
            [
                pose.rotation[:, component]
                for pose, (_, component) in zip(before, tilts, strict=True)
            ]
        )
        centers = np.array([pose.translation for pose in before])
        axes = (rotation @ axes[..., None])[..., 0]
        centers = translation + (rotation @ centers[..., None])[..., 0]
        arms = self.place(q)[..., None, :] - centers[..., None, :, :]
        moved = np.stack([self._beyond[joint] for joint in joints], axis=1)
        turned = np.cross(axes[..., None, :, :], arms) * moved[..., None]
        return np.swapaxes(turned, -1, -2)

    def _poses(
        self, q: Array, joints: Sequence[int], *, twists: Array | None = None
    ) -> tuple[Array, Array]:
        """Rotations (..., J, 3, 3) and translations (..., J, 3) m of joints.

        Also writes the columns of all joints' Jacobians into `twists`.
        """
        model, data = self._model, self._data
        rows = q.reshape(-1, model.nq)
        turned = np.empty((len(rows), len(joints), 3, 3))  # by columns, as Pinocchio's
        translation = np.empty((len(rows), len(joints), 3))
        columns = None if twists is None else twists.reshape(len(rows), 6, model.nv)
        for k, row in enumerate(rows):
            if columns is None:
                pin.forwardKinematics(model, data, row)
            else:
                columns[k] = pin.computeJointJacobians(model, data, row)
            for j, joint in enumerate(joints):
                pose = data.oMi[joint]
                turned[k, j], translation[k, j] = pose.rotation.T, pose.translation
        shape = (*q.shape[:-1], len(joints))
        rotation = np.swapaxes(turned.reshape(*shape, 3, 3), -1, -2)
        return rotation, translation.reshape(*shape, 3)

    def _positions(self, rotation: Array, translation: Array) -> Array:
        positions = np.empty((*rotation.shape[:-3], len(self.joint), 3))
        turned = np.swapaxes(rotation, -1, -2)
        for j, (rows, in_joint) in enumerate(self._carried):
            places = in_joint @ turned[..., j, :, :]
            positions[..., rows, :] = places + translation[..., j, None, :]
        return positions


def grown_positions(
    urdf: str, marker_set: MarkerSet, factors: Mapping[str, float]
) -> Array:
    """Markers in their links, (M, 3) m, after the segments of a URDF are resized.

    `factors` are size factors by link; markers keep their place along the segment.
    """
    positions = np.array([m.position for m in marker_set.markers]).reshape(-1, 3)
    growth = [factors.get(m.link, 1.0) - 1 for m in marker_set.markers]
    along = part_along(urdf, marker_set, positions)
    return positions + np.array(growth).reshape(-1, 1) * along


def part_along(urdf: str, marker_set: MarkerSet, positions: Array) -> Array:
    """Part of the markers' positions (M, 3) that scales with their segment.

    Along a limb only, as girth does not follow length; on the thorax, all of it.
    """
    ends = segment_ends(urdf)
    axes = np.zeros((len(positions), 3, 3))
    for axis, marker in zip(axes, marker_set.markers, strict=True):
        if marker.link in ends:
            unit = ends[marker.link] / np.linalg.norm(ends[marker.link])
            axis[:] = np.outer(unit, unit)
        elif marker.link in SEGMENTS:
            axis[:] = np.eye(3)
    return np.einsum("mij,mj->mi", axes, positions)
