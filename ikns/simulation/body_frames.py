"""Marker frames of a seated body while one arm moves along a self-motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ikns._kernels.body.simulated_markers import write_markers, write_posture
from ikns.arrays import Array
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.simulation.arm import ArmKinematics, SelfMotion
from ikns.simulation.artifacts import SoftTissue, occlusions
from ikns.simulation.trial import SEATED_SWAY, place_in_room, still_joints

#: Height of the thorax frame, m: no result depends on it.
_HEIGHT = 1.0


class BodyFrames:
    """Body and cameras, frame by frame.

    What does not depend on the moving arm (sway of the trunk, the other joints, camera
    noise, gaps) is drawn in advance for all frames, with `generators` for the body,
    camera noise, gaps and skin. `arm` is of the true body, `subject` the same person as
    calibrated, whose markers are recorded: `columns` of those that the true body wears.
    The drift of the hand (n, 6), m and rad, is added to the joints by the
    pseudo-inverse of the Jacobian, correct to first order.
    """

    def __init__(
        self,
        arm: ArmKinematics,
        angles: Array,
        subject: Subject,
        *,
        drift: Array,
        rate: float,
        generators: Sequence[np.random.Generator],
        marker_noise: float,
        occluded: float,
        skin: SoftTissue | None,
    ) -> None:
        of_body, of_noise, of_gaps, of_skin = generators
        frames, worn = len(drift), arm.skeleton.marker_set
        self.columns = subject.skeleton.marker_set.columns(worn.labels)
        links = np.array([worn.markers[i].link for i in self.columns])
        self._tree, self._arm_columns = arm.skeleton.tree, np.array(arm.columns)
        self._drift = np.array(drift, dtype=np.float64)
        self._q = place_in_room(
            still_joints(angles, frames, rate=rate, rng=of_body),
            height=_HEIGHT,
            heading=0.0,
            sway=SEATED_SWAY,
            rate=rate,
            rng=of_body,
        )
        self._to_world = Rotation.from_quat(self._q[:, 3:7]).as_matrix()
        self._noise = marker_noise * of_noise.normal(size=(frames, len(links), 3))
        hidden = occlusions(of_gaps, frames, links, share=occluded, rate=rate)
        self._noise[hidden] = np.nan
        if skin is not None:
            # Isotropic noise is the same whether or not it turns with the segment.
            moved = skin.at_random(frames, rate=rate, rng=of_skin)
            self._noise += moved[:, self.columns]
        joint, in_joint = arm.skeleton.tree_markers
        self._joint, self._in_joint = joint[self.columns], in_joint[self.columns]
        joints = len(arm.skeleton.joint_names) + 1
        self._turns = np.empty((2, 7 + len(arm.skeleton.joint_names)))
        self._rotation = np.empty((joints, 3, 3))
        self._translation = np.empty((joints, 3))

    def posture(self, frame: int, row: Array) -> Array:
        """Return the true configuration of the body (25,); row of :func:`arm_rows`."""
        if frame >= len(self._drift):
            raise InvalidInput(f"expected {len(self._drift)} frames, found one more.")
        q = self._q[frame].copy()
        write_posture(self._arm_columns, row, self._drift[frame], q)
        return q

    def markers(self, frame: int, row: Array) -> Array:
        """Return the markers that the cameras record, (M, 3) m; see :meth:`posture`."""
        q = self.posture(frame, row)
        markers = np.empty(self._in_joint.shape)
        write_markers(
            self._tree,
            q,
            self._joint,
            self._in_joint,
            row[51:],
            self._to_world[frame],
            self._noise[frame],
            self._turns,
            self._rotation,
            self._translation,
            markers,
        )
        return markers


def arm_rows(
    arm: ArmKinematics,
    angles: Array,
    motion: SelfMotion,
    *,
    skin: SoftTissue | None,
    columns: NDArray[np.intp],
) -> Array:
    """Return the states of an arm along a self-motion, to interpolate between them.

    (K, 51 + 3 M): posture (9), pseudo-inverse of the Jacobian (42), displacement of the
    markers in `columns` by the skin in the thorax frame (3 each). `angles` (18,) are
    those of the rest of the body.
    """
    bodies = np.array([arm.put(angles, posture) for posture in motion.postures])
    inverse = np.linalg.pinv(arm.skeleton.chain_jacobian(bodies, arm.chain))
    q = np.hstack([np.tile(arm.skeleton.neutral()[:7], (len(bodies), 1)), bodies])
    shift = np.zeros((len(q), len(columns), 3))
    if skin is not None:
        shift = skin.in_world(q, skin.with_posture(q))[:, columns]
    flat = [inverse.reshape(len(q), -1), shift.reshape(len(q), -1)]
    return np.hstack([motion.postures, *flat])
