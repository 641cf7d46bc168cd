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
        self._carried = []
        for joint in np.unique(self.joint):
            rows = np.flatnonzero(self.joint == joint)
            self._carried.append((int(joint), rows, self.in_joint[rows]))

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
        """Positions in the world, (M, 3) m."""
        pin.forwardKinematics(self._model, self._data, q)
        return self._positions()

    def jacobian(self, q: Array) -> tuple[Array, Array]:
        """Positions (M, 3) m and their derivative by the tangent, (M, 3, nv).

        Column j is ``linear_j + angular_j x position`` for the joints between the root
        and the marker, else zero.
        """
        twists = np.array(pin.computeJointJacobians(self._model, self._data, q))
        positions = self._positions()
        linear, (wx, wy, wz) = twists[:3], twists[3:]
        x, y, z = positions.T[:, :, None]
        jacobian = np.empty((len(positions), 3, self._model.nv))
        jacobian[:, 0] = linear[0] + wy * z - wz * y
        jacobian[:, 1] = linear[1] + wz * x - wx * z
        jacobian[:, 2] = linear[2] + wx * y - wy * x
        jacobian *= self._moves[:, None, :]
        return positions, jacobian

    def by_size(self, q: Array, along: Array) -> tuple[Array, Array]:
        """Differentiate by the log sizes, (M, 3, S), and the marker places, (M, 3, 3).

        `along` (M, 3) is the part of each marker's position that scales with its
        segment, in the joint's frame, m.
        """
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, q)
        by_size = np.zeros((len(self.joint), 3, len(SEGMENTS)))
        for s, segment in enumerate(SEGMENTS):
            carrier = self._carrier[segment]
            rotation = data.oMi[carrier].rotation
            for joint in model.children[carrier]:
                by_size[self._beyond[joint], :, s] = (
                    rotation @ model.jointPlacements[joint].translation
                )
            own = self.joint == carrier
            by_size[own, :, s] = along[own] @ rotation.T
        by_place = np.empty((len(self.joint), 3, 3))
        for joint, rows, _ in self._carried:
            by_place[rows] = data.oMi[joint].rotation
        return by_size, by_place

    def by_tilt(self, q: Array, tilts: Sequence[tuple[str, int]]) -> Array:
        """Differentiate by tilts of joints, (M, 3, K) m/rad.

        A tilt is a joint and the axis of its frame, 0 to 2, about which it turns before
        it moves.
        """
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, q)
        positions = self._positions()
        joints = [model.getJointId(name) for name, _ in tilts]
        frames = [
            data.oMi[model.parents[joint]] * model.jointPlacements[joint]
            for joint in joints
        ]
        axes = np.array(
            [
                frame.rotation[:, component]
                for frame, (_, component) in zip(frames, tilts, strict=True)
            ]
        )
        arms = positions[:, None] - np.array([frame.translation for frame in frames])
        moved = np.stack([self._beyond[joint] for joint in joints], axis=1)
        return np.swapaxes(np.cross(axes, arms) * moved[..., None], 1, 2)

    def _positions(self) -> Array:
        positions = np.empty_like(self.in_joint)
        for joint, rows, in_joint in self._carried:
            pose = self._data.oMi[joint]
            positions[rows] = in_joint @ pose.rotation.T + pose.translation
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
