"""The skeleton: a person's URDF and markers; sole owner of Pinocchio's model and data.

A configuration ``q`` is (25,): position of the thorax in the world (m), its unit
quaternion x, y, z, w, then 18 joint angles (rad) in the order of
:attr:`Skeleton.joint_names`. Its tangent ``v`` is (24,): linear and angular velocity of
the thorax in its own frame, then the joint velocities.

What is seen from the thorax takes one configuration or many, (..., 25), or joint angles
alone, (..., 18), and returns NaN where they hold NaN.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ikns._kernels.body.paths import Paths
from ikns._kernels.body.tree import Tree
from ikns.arrays import Array, Indices
from ikns.body.anthropometry import Segment, segments
from ikns.body.chains import SIDES, ChainLike, as_chain
from ikns.body.joint_axes import tilt_urdf
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import (
    GENERIC_STATURE,
    Inertial,
    link_inertials,
    relative_sizes,
    resize_urdf,
    segment_lengths,
    urdf_folder,
)
from ikns.body.skeleton.frames import LinkFrames
from ikns.body.skeleton.markers import Markers, grown_positions, part_along
from ikns.body.skeleton.model import NQ_ROOT, NV_ROOT, read_urdf, upper_body_model
from ikns.errors import InvalidInput
from ikns.numerics.subspace import null_spaces


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

    Examples
    --------
    >>> skeleton = Skeleton.load()
    >>> q = skeleton.neutral()
    >>> skeleton.markers_in_world(q).shape, skeleton.hands_in_thorax(q)[0].shape
    ((24, 3), (2, 3))
    """

    def __init__(self, urdf: str, marker_set: MarkerSet) -> None:
        model = upper_body_model(urdf)
        self.urdf = urdf
        self.marker_set = marker_set
        self._model = model
        self.joint_names: tuple[str, ...] = tuple(model.names)[2:]
        self.lower: Array = np.array(model.lowerPositionLimit[NQ_ROOT:])
        self.upper: Array = np.array(model.upperPositionLimit[NQ_ROOT:])
        self._markers = Markers(model, marker_set)

    @classmethod
    def load(
        cls, path: str | Path | None = None, *, marker_set: str | Path = "oxford24"
    ) -> Skeleton:
        """Read a URDF file; without one, the generic upper body."""
        file = urdf_folder() / "upper_body.urdf" if path is None else Path(path)
        return cls(read_urdf(file), MarkerSet.load(marker_set))

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

        Stature in m, mass in kg, "female" or "male"; the marker set is what the person
        wears.

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
        """Return a skeleton with a person's segments and, for the thorax, stature (m).

        Parts are as from :func:`ikns.body.anthropometry.segments`.
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
        tilts: Mapping[str, Array] | None = None,
    ) -> Skeleton:
        """Return a skeleton with segments resized; markers keep their place along them.

        Arguments are those of :func:`ikns.body.model_file.resize_urdf`, and those of
        :meth:`tilted`.
        """
        urdf = resize_urdf(self.urdf, factors, inertials=inertials)
        if tilts is not None:
            urdf = tilt_urdf(urdf, tilts)
        positions = grown_positions(self.urdf, self.marker_set, factors)
        return Skeleton(urdf, self.marker_set.at(positions))

    def with_markers(self, marker_set: MarkerSet) -> Skeleton:
        """Return the same body with these markers, at the places that the set has."""
        return Skeleton(self.urdf, marker_set)

    def with_nominal_markers(self, marker_set: MarkerSet) -> Skeleton:
        """Return the same body with markers at the nominal places for its size.

        A shipped set has the places on the generic body; on a longer limb they lie
        farther apart. The body's own set stays as it is.
        """
        if marker_set is self.marker_set:
            return self
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

    def columns(self, joints: tuple[str, ...]) -> Indices:
        """Columns of the tangent space that belong to these joints."""
        unknown = [joint for joint in joints if joint not in self.joint_names]
        if unknown:
            raise InvalidInput(f"the skeleton has no joint {', '.join(unknown)}.")
        return np.array([NV_ROOT + self.joint_names.index(j) for j in joints])

    @property
    def tree(self) -> Tree:
        """The joints; joint 0 is the thorax's free flyer."""
        return self._frames.tree

    @cached_property
    def tree_markers(self) -> tuple[Indices, Array]:
        """Each marker's joint in the tree, (M,), and place in its frame, (M, 3) m."""
        joint = self._markers.joint - 1
        turned = self._frames.turned[joint]
        return joint, np.einsum("mji,mj->mi", turned, self._markers.in_joint)

    def tree_link(self, link: str) -> tuple[int, Array, Array]:
        """Joint of the tree that carries a link; rotation and translation (m) there."""
        return self._frames.in_tree(link)

    @cached_property
    def hand_paths(self) -> Paths:
        """From the thorax to the right and the left knuckle frame."""
        return self._frames.paths(tuple(f"{side}_knuckle" for side in SIDES))

    @property
    def elbow_paths(self) -> Paths:
        """From the thorax to the right and left shoulder, elbow and wrist."""
        return self._frames.elbow_paths

    def paths(
        self,
        links: tuple[str, ...],
        columns: tuple[str, ...] = (),
        base: str = "thorax",
    ) -> Paths:
        """Return the paths from the thorax, or another base, to links, for a kernel.

        `columns` are the joints of a Jacobian's columns.
        """
        return self._frames.paths(links, columns, base)

    @cached_property
    def _along(self) -> Array:
        return part_along(self.urdf, self.marker_set, self._markers.in_joint)

    @cached_property
    def _frames(self) -> LinkFrames:
        return LinkFrames(self._model)

    def markers_in_world(self, q: Array) -> Array:
        """Marker positions at configurations (..., 25), (..., M, 3) m."""
        return self._markers.place(q)

    def marker_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Marker positions in the world, and d position / d v.

        (..., M, 3) m and (..., M, 3, nv) at configurations (..., 25).
        """
        return self._markers.jacobian(q)

    def size_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Differentiate the marker positions by the body's sizes.

        Returns d position / d log(factor) of each segment of
        :data:`ikns.body.model_file.SEGMENTS`, (..., M, 3, S) m, and d position / d
        (marker position in its link), which is the link's orientation, (..., M, 3, 3),
        at configurations (..., 25).
        """
        return self._markers.by_size(q, self._along)

    def tilt_jacobian(self, q: Array, tilts: Sequence[tuple[str, int]]) -> Array:
        """Differentiate the marker positions by tilts of joints, (..., M, 3, K) m/rad.

        A tilt is a joint and an axis of its frame, 0 to 2, see
        :mod:`ikns.body.joint_axes`.
        """
        return self._markers.by_tilt(q, tilts)

    def tilted(self, tilts: Mapping[str, Array]) -> Skeleton:
        """Return a skeleton with joints tilted by rotation vectors (3,) rad."""
        return Skeleton(tilt_urdf(self.urdf, tilts), self.marker_set)

    def link_in_thorax(self, q: ArrayLike, link: str) -> tuple[Array, Array]:
        """Origin of a link, (..., 3) m, and orientation, (..., 3, 3)."""
        position, rotation = self._frames.place(q, (link,))
        return position[..., 0, :], rotation[..., 0, :, :]

    def hands_in_thorax(self, q: ArrayLike) -> tuple[Array, Array]:
        """Right and left knuckle, (..., 2, 3) m, and orientation, (..., 2, 3, 3)."""
        return self._frames.place(q, [f"{side}_knuckle" for side in SIDES])

    def chain_ends(self, q: ArrayLike, chain: ChainLike) -> tuple[Array, Array]:
        """Return a chain's ends in its base, (..., E, 3) m, and their orientation.

        Of ``"right_arm"`` that is the right knuckle in the thorax frame. Orientations
        are (..., E, 3, 3).
        """
        own = as_chain(chain)
        return self._frames.place(q, own.ends, own.base)

    def chain_jacobian(
        self, q: ArrayLike, chain: ChainLike, *, task: str = "pose"
    ) -> Array:
        """Jacobian of a chain's ends, its hands, in the thorax frame (or its base's).

        Parameters
        ----------
        q : (..., 25) or (..., 18) array
            Configurations, or joint angles alone.
        chain : str
            See :class:`ikns.Chain`.
        task : {"pose", "position"}
            Hand position and orientation, or position alone.

        Returns
        -------
        (..., k, n) array
            Per end 3 rows of linear velocity (m/rad), then for ``"pose"`` 3 rows of
            angular velocity (rad/rad); columns in chain order.
        """
        return self._frames.jacobian(q, chain, task)

    def null_spaces(
        self, q: ArrayLike, chain: ChainLike, *, task: str = "pose", rtol: float = 1e-9
    ) -> tuple[Array, Indices]:
        """Joint motions of a chain that leave its hands where they are.

        Parameters
        ----------
        q, chain, task
            As :meth:`chain_jacobian` takes them.
        rtol : float
            See :func:`ikns.numerics.subspace.null_spaces`, which this calls.

        Returns
        -------
        basis : (..., d, n) array
        rank : (...) integer array

        Examples
        --------
        >>> skeleton = Skeleton.load()
        >>> basis, rank = skeleton.null_spaces(np.full((10, 18), 0.3), "right_arm")
        >>> basis.shape
        (10, 1, 7)
        """
        return null_spaces(self.chain_jacobian(q, chain, task=task), rtol=rtol)

    def swivel(self, q: ArrayLike) -> Array:
        """Elbow angle about the line from shoulder to wrist, (..., 2) rad.

        Zero with the elbow straight below the line, positive where the elbow is lifted
        outward (the right one to the right); NaN for a straight arm.
        """
        return self._frames.swivel(q)
