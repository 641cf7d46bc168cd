"""The skeleton: a person's URDF and markers; sole owner of Pinocchio's model and data.

A configuration ``q`` is (25,): position of the thorax in the world (m), its unit
quaternion x, y, z, w, then 18 joint angles (rad) in the order of
:attr:`Skeleton.joint_names`. Its tangent ``v`` is (24,): linear and angular velocity of
the thorax in its own frame, then the joint velocities.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ikns._kernels.tree import Tree
from ikns.anthropometry import Segment, segments
from ikns.body import (
    GENERIC_STATURE,
    SEGMENTS,
    Inertial,
    link_inertials,
    relative_sizes,
    resize_urdf,
    segment_ends,
    segment_lengths,
    urdf_folder,
)
from ikns.errors import FileError, InvalidInput, MarkerMismatch
from ikns.marker_set import MarkerSet
from ikns.motion import SIDES, chain_joints, chain_sides
from ikns.skeleton.tree import joint_tree

__all__ = ["Skeleton"]

Array = NDArray[np.float64]

#: Columns of `q` and `v` that hold the thorax.
_NQ_ROOT, _NV_ROOT = 7, 6


class Skeleton:
    """An upper body with markers on it.

    Parameters
    ----------
    urdf : str
        URDF text; the root link is the thorax, which gets a free flyer.
    marker_set : MarkerSet
        Markers in link frames.

    Raises
    ------
    FileError
        When the URDF cannot be read or is not an upper body.
    MarkerMismatch
        When a marker sits on a link that the URDF does not have.
    """

    def __init__(self, urdf: str, marker_set: MarkerSet) -> None:
        try:
            # Pinocchio's own parser prints to the terminal before it raises.
            ET.fromstring(urdf)
            model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
        except (ET.ParseError, ValueError, RuntimeError) as error:
            raise FileError(f"the URDF cannot be read: {error}") from None
        self.urdf = urdf
        self.marker_set = marker_set
        self._model, self._data = model, model.createData()
        self.joint_names: tuple[str, ...] = tuple(model.names)[2:]
        missing = {j for side in SIDES for j in chain_joints(f"{side}_arm_clavicle")}
        missing -= set(self.joint_names)
        if missing or model.nq != _NQ_ROOT + len(self.joint_names):
            raise FileError(
                "the URDF is not an upper body of revolute joints: it lacks "
                f"{', '.join(sorted(missing)) or 'one-angle joints'}."
            )
        self.lower: Array = np.array(model.lowerPositionLimit[_NQ_ROOT:])
        self.upper: Array = np.array(model.upperPositionLimit[_NQ_ROOT:])
        self._hands = [self._frame(f"{side}_knuckle") for side in SIDES]
        self._attach_markers()

    @classmethod
    def load(
        cls, path: str | Path | None = None, *, marker_set: str | Path = "oxford24"
    ) -> Skeleton:
        """Read a URDF file; without one, the generic upper body.

        >>> len(Skeleton.load().joint_names)
        18
        """
        file = urdf_folder() / "upper_body.urdf" if path is None else Path(path)
        try:
            text = file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{file}: cannot be read as a URDF: {error}") from None
        return cls(text, MarkerSet.load(marker_set))

    @classmethod
    def from_anthropometry(
        cls,
        stature: float,
        mass: float,
        sex: str,
        *,
        marker_set: str | Path = "oxford24",
    ) -> Skeleton:
        """Return the body of an average adult of this stature, mass and sex.

        Parameters
        ----------
        stature : float
            Meters.
        mass : float
            Kilograms.
        sex : str
            "female" or "male".
        marker_set : str or path
            What the person wears.

        Examples
        --------
        >>> skeleton = Skeleton.from_anthropometry(1.75, 70, "female")
        >>> round(skeleton.segment_lengths["right_upper_arm"], 3)
        0.277
        """
        return cls.load(marker_set=marker_set).proportioned(
            segments(stature, mass, sex), stature=stature
        )

    def proportioned(self, parts: Mapping[str, Segment], *, stature: float) -> Skeleton:
        """Return a skeleton with a person's segments.

        Parameters
        ----------
        parts : mapping
            As from :func:`ikns.anthropometry.segments`.
        stature : float
            Meters; sizes the thorax.
        """
        lengths = self.segment_lengths
        factors = {"thorax": stature / GENERIC_STATURE}
        for name in lengths:
            factors[name] = parts[name.split("_", 1)[1]].length_m / lengths[name]
        return self.resized(factors, inertials=link_inertials(self.urdf, parts))

    def resized(
        self,
        factors: Mapping[str, float],
        *,
        inertials: Mapping[str, Inertial] | None = None,
    ) -> Skeleton:
        """Return a skeleton with segments resized; markers keep their place along them.

        Parameters
        ----------
        factors : mapping
            Size factor per segment (see :data:`ikns.body.SEGMENTS`).
        inertials : mapping, optional
            New inertial properties by link name.
        """
        urdf = resize_urdf(self.urdf, factors, inertials=inertials)
        growth = [factors.get(m.link, 1.0) - 1 for m in self.marker_set.markers]
        positions = self.marker_positions
        positions += np.array(growth).reshape(-1, 1) * self._along(positions)
        return Skeleton(urdf, self.marker_set.at(positions))

    def with_markers(self, marker_set: MarkerSet) -> Skeleton:
        """Return the same body wearing these markers where the set says."""
        return Skeleton(self.urdf, marker_set)

    def wearing(self, marker_set: MarkerSet) -> Skeleton:
        """Return the same body with markers at the nominal places for its size.

        A shipped set's places are those on the generic body; along a longer limb they
        lie farther apart.
        """
        generic = Skeleton.load().urdf
        sizes = relative_sizes(self.urdf, generic)
        sized = Skeleton(generic, marker_set).resized(sizes).marker_set
        return Skeleton(self.urdf, sized)

    def write(self, path: str | Path) -> None:
        """Write the URDF."""
        Path(path).write_text(self.urdf, encoding="utf-8")

    @property
    def segment_lengths(self) -> dict[str, float]:
        """Joint-to-joint length of each segment, meters."""
        return segment_lengths(self.urdf)

    @property
    def marker_positions(self) -> Array:
        """Markers in their link's frame, (M, 3) m."""
        return np.array([m.position for m in self.marker_set.markers]).reshape(-1, 3)

    @property
    def nv(self) -> int:
        """Dimension of the tangent space, 24 for the upper body."""
        return int(self._model.nv)

    def neutral(self) -> Array:
        """Thorax at the world's origin, arms hanging, (25,)."""
        return np.array(pin.neutral(self._model))

    def integrate(self, q: Array, v: Array) -> Array:
        """Return the configuration after the tangent step `v` from `q`."""
        return np.array(pin.integrate(self._model, q, v))

    def difference(self, q0: Array, q1: Array) -> Array:
        """Return the tangent step that leads from `q0` to `q1`."""
        return np.array(pin.difference(self._model, q0, q1))

    def columns(self, joints: tuple[str, ...]) -> NDArray[np.int64]:
        """Columns of the tangent space that belong to these joints."""
        unknown = [joint for joint in joints if joint not in self.joint_names]
        if unknown:
            raise InvalidInput(f"the skeleton has no joint {', '.join(unknown)}.")
        return np.array([_NV_ROOT + self.joint_names.index(j) for j in joints])

    # --- the body as arrays, for kernels --------------------------------------------

    @property
    def tree(self) -> Tree:
        """The joints; joint 0 is the thorax's free flyer."""
        return self._tree[0]

    @cached_property
    def tree_markers(self) -> tuple[NDArray[np.int64], Array]:
        """Each marker's joint in the tree, (M,), and place in its frame, (M, 3) m."""
        joint = self._marker_joint - 1
        turned = self._tree[1][joint]
        return joint, np.einsum("mji,mj->mi", turned, self._marker_in_joint)

    @cached_property
    def tree_hands(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Right and left knuckle frame in the tree.

        Returns
        -------
        joint : (2,) integer array
        rotation : (2, 3, 3) array
        translation : (2, 3) array
            The frame's placement in the joint's frame, m.
        """
        frames = [self._model.frames[frame] for frame in self._hands]
        joint = np.array([frame.parentJoint - 1 for frame in frames], dtype=np.int64)
        back = np.swapaxes(self._tree[1][joint], 1, 2)
        rotation = np.stack([frame.placement.rotation for frame in frames])
        translation = np.stack([frame.placement.translation for frame in frames])
        return joint, back @ rotation, np.einsum("hij,hj->hi", back, translation)

    @cached_property
    def _tree(self) -> tuple[Tree, Array]:
        return joint_tree(self._model)

    # --- markers in the world -------------------------------------------------------

    def markers_in_world(self, q: Array) -> Array:
        """Marker positions at `q`, (M, 3) m."""
        pin.forwardKinematics(self._model, self._data, q)
        return self._place_markers()

    def marker_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Marker positions and their derivative by the tangent of `q`.

        Returns
        -------
        positions : (M, 3) array
            Meters in the world.
        jacobian : (M, 3, nv) array
            d position / d v: column j is ``linear_j + angular_j x position`` for the
            joints between the root and the marker, else zero.
        """
        twists = np.array(pin.computeJointJacobians(self._model, self._data, q))
        positions = self._place_markers()
        linear, (wx, wy, wz) = twists[:3], twists[3:]
        x, y, z = positions.T[:, :, None]
        jacobian = np.empty((len(positions), 3, self._model.nv))
        jacobian[:, 0] = linear[0] + wy * z - wz * y
        jacobian[:, 1] = linear[1] + wz * x - wx * z
        jacobian[:, 2] = linear[2] + wx * y - wy * x
        jacobian *= self._moves[:, None, :]
        return positions, jacobian

    def size_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Differentiate the marker positions by the body's sizes.

        Returns
        -------
        by_size : (M, 3, S) array
            d position / d log(factor) of each segment of
            :data:`ikns.body.SEGMENTS`, m.
        by_position : (M, 3, 3) array
            d position / d (marker position in its link): the link's orientation.
        """
        pin.forwardKinematics(self._model, self._data, q)
        model, data = self._model, self._data
        by_size = np.zeros((len(self._marker_joint), 3, len(SEGMENTS)))
        for s, segment in enumerate(SEGMENTS):
            carrier = model.frames[self._frame(segment)].parentJoint
            rotation = data.oMi[carrier].rotation
            for joint in model.children[carrier]:
                below = list(model.subtrees[joint])
                moved = np.isin(self._marker_joint, below)
                by_size[moved, :, s] = (
                    rotation @ model.jointPlacements[joint].translation
                )
            own = self._marker_joint == carrier
            by_size[own, :, s] = self._along(self._marker_in_joint)[own] @ rotation.T
        by_position = np.stack([data.oMi[int(j)].rotation for j in self._marker_joint])
        return by_size, by_position

    # --- the body seen from the thorax ----------------------------------------------

    def link_in_thorax(self, q: Array, link: str) -> tuple[Array, Array]:
        """Origin (3,) m and orientation (3, 3) of a link in the thorax frame."""
        frame = self._frame(link)
        self._update_in_thorax(q)
        pose = pin.updateFramePlacement(self._model, self._data, frame)
        return np.array(pose.translation), np.array(pose.rotation)

    def hands_in_thorax(self, q: Array) -> tuple[Array, Array]:
        """Right and left knuckle, (2, 3) m, and hand orientation, (2, 3, 3)."""
        self._update_in_thorax(q)
        poses = [
            pin.updateFramePlacement(self._model, self._data, frame)
            for frame in self._hands
        ]
        return (
            np.stack([pose.translation for pose in poses]),
            np.stack([pose.rotation for pose in poses]),
        )

    def chain_jacobian(self, q: Array, chain: str, *, task: str = "pose") -> Array:
        """Jacobian of a chain's hands in the thorax frame.

        Parameters
        ----------
        q : (25,) or (18,) array
            Configuration, or joint angles alone.
        chain : str
            See :data:`ikns.motion.CHAINS`.
        task : {"pose", "position"}
            Hand position and orientation, or position alone.

        Returns
        -------
        (k, n) array
            Per hand 3 rows of linear velocity (m/rad), then for ``"pose"`` 3 rows of
            angular velocity (rad/rad); columns in chain order.
        """
        if task not in ("pose", "position"):
            raise InvalidInput(f"task must be 'pose' or 'position', not '{task}'.")
        columns = self.columns(chain_joints(chain))
        self._update_in_thorax(q, jacobians=True)
        rows = 6 if task == "pose" else 3
        blocks = []
        for side in chain_sides(chain):
            frame = self._hands[SIDES.index(side)]
            pin.updateFramePlacement(self._model, self._data, frame)
            full = pin.getFrameJacobian(
                self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED
            )
            blocks.append(full[:rows, columns])
        return np.vstack(blocks)

    def swivel(self, q: Array) -> Array:
        """Elbow angle about the line from shoulder to wrist, (2,) rad.

        Zero with the elbow straight below the line, positive where the elbow is lifted
        outwards (the right one to the right).
        """
        angles = np.empty(2)
        for i, side in enumerate(SIDES):
            shoulder, elbow, wrist = (
                self.link_in_thorax(q, f"{side}_{link}")[0]
                for link in ("upper_arm", "forearm", "hand")
            )
            line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
            radial = elbow - shoulder - line * np.dot(elbow - shoulder, line)
            down = -np.eye(3)[1] + line * line[1]
            outward = np.cross(down, line) * (1 if side == "right" else -1)
            angles[i] = np.arctan2(radial @ outward, radial @ down)
        return angles

    # --- inside -----------------------------------------------------------------------

    def _along(self, positions: Array) -> Array:
        """Part of the markers' places (M, 3) that grows with their segment.

        Along a limb; girth is not a matter of length. On the thorax, all of it.
        """
        ends = segment_ends(self.urdf)
        axes = np.zeros((len(positions), 3, 3))
        for axis, marker in zip(axes, self.marker_set.markers, strict=True):
            if marker.link in ends:
                unit = ends[marker.link] / np.linalg.norm(ends[marker.link])
                axis[:] = np.outer(unit, unit)
            elif marker.link in SEGMENTS:
                axis[:] = np.eye(3)
        return np.einsum("mij,mj->mi", axes, positions)

    def _frame(self, link: str) -> int:
        # Pinocchio answers an unknown name with the number of frames.
        index = self._model.getFrameId(link, pin.FrameType.BODY)
        if index >= self._model.nframes:
            raise FileError(f"the URDF has no link '{link}'.")
        return int(index)

    def _attach_markers(self) -> None:
        model = self._model
        links = {f.name for f in model.frames if f.type == pin.FrameType.BODY}
        unknown = [m for m in self.marker_set.markers if m.link not in links]
        if unknown:
            raise MarkerMismatch(
                f"marker {unknown[0].label} sits on link '{unknown[0].link}', "
                "which the URDF does not have."
            )
        frames = [model.frames[self._frame(m.link)] for m in self.marker_set.markers]
        self._marker_joint = np.array([f.parentJoint for f in frames], dtype=np.int64)
        self._marker_in_joint = np.array(
            [
                f.placement.act(np.array(m.position))
                for f, m in zip(frames, self.marker_set.markers, strict=True)
            ]
        ).reshape(-1, 3)
        self._carried = []
        for joint in np.unique(self._marker_joint):
            rows = np.flatnonzero(self._marker_joint == joint)
            self._carried.append((int(joint), rows, self._marker_in_joint[rows]))
        self._moves = np.zeros((len(frames), model.nv))
        for row, joint in zip(self._moves, self._marker_joint, strict=True):
            for ancestor in model.supports[int(joint)][1:]:
                start = model.idx_vs[ancestor]
                row[start : start + model.nvs[ancestor]] = 1.0

    def _place_markers(self) -> Array:
        positions = np.empty_like(self._marker_in_joint)
        for joint, rows, in_joint in self._carried:
            pose = self._data.oMi[joint]
            positions[rows] = in_joint @ pose.rotation.T + pose.translation
        return positions

    def _update_in_thorax(self, q: Array, *, jacobians: bool = False) -> None:
        # With the thorax at the origin, the world frame is the thorax frame.
        at_origin = self.neutral()
        at_origin[_NQ_ROOT:] = q[-len(self.joint_names) :]
        if jacobians:
            pin.computeJointJacobians(self._model, self._data, at_origin)
        else:
            pin.forwardKinematics(self._model, self._data, at_origin)
