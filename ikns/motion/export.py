"""A motion as files for other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.motion.file_names import FITTED, MODEL, check_motion_file
from ikns.motion.gimbal import xyz_angles
from ikns.motion.motion import Motion
from ikns.motion.opensim_model import opensim_model
from ikns.motion.table import motion_table
from ikns.output.file import write_csv, write_text
from ikns.recording.files import write
from ikns.recording.files.storage import (
    CoordinateTable,
    complete_frames,
    write_storage,
)
from ikns.recording.recording import Recording


def write_motion(
    path: Path,
    motion: Motion,
    skeleton: Skeleton,
    *,
    up: Array | None = None,
    force: bool = False,
) -> str:
    """Write a motion; the ending of the name decides what.

    Parameters
    ----------
    path : Path
        ``.csv``: the table of :func:`ikns.motion.table.motion_table`. ``.mot`` and
        ``.sto``: coordinates for OpenSim, in degrees and meters. ``.osim``: the body
        whose coordinates these are, as a model of OpenSim. ``.trc`` and ``.c3d``: the
        markers where the fitted body carries them.
    motion : Motion
    skeleton : Skeleton
        The body that moves.
    up : (3,) array, optional
        Unit vector up in the laboratory, for the gravity of an ``.osim``; see
        :func:`ikns.motion.lab_vertical.lab_vertical`.
    force : bool
        Whether to replace a file that exists.

    Returns
    -------
    str
        A sentence about what the file cannot hold and does not; empty for nothing.
    """
    check_motion_file(path)
    ending = path.suffix.lower()
    if ending == ".csv":
        table = motion_table(motion)
        write_csv(path, table.columns, table.rows, force=force)
        return ""
    if ending in FITTED:
        write(path, fitted_markers(skeleton, motion), force=force)
        return ""
    if ending == MODEL:
        write_text(path, opensim_model(skeleton, up), force=force)
        return ""
    coordinates = motion_coordinates(motion)
    if not len(coordinates.time):
        raise InvalidInput(
            f"{path}: expected a frame that shows all joints, as OpenSim's files have "
            f"no gaps, found none; write a .csv file."
        )
    write_storage(path, coordinates, force=force)
    lost = len(motion.time) - len(coordinates.time)
    unseen = 6 + len(motion.joint_names) - len(coordinates.names)
    parts = [f"{lost} frames that do not show all joints"] if lost else []
    parts += [f"{unseen} coordinates that no frame shows"] if unseen else []
    return f"{path} is without {' and '.join(parts)}." if parts else ""


def motion_coordinates(motion: Motion) -> CoordinateTable:
    """Return joint angles and the pose of the thorax as coordinates of OpenSim.

    The thorax has ``thorax_tx``, ``_ty``, ``_tz``, m in the world, and ``thorax_rx``,
    ``_ry``, ``_rz``, its rotations about its own x, then y, then z, deg. OpenSim's
    files have no empty cells, so coordinates without any value are left out, and then
    frames in which one is missing.
    """
    pose = motion.thorax_in_world
    names = [f"thorax_{kind}{axis}" for kind in "tr" for axis in "xyz"]
    values = np.hstack(
        [pose[:, :3], _rotations(pose[:, 3:]), np.degrees(motion.angles)]
    )
    return complete_frames(
        motion.time, [*names, *motion.joint_names], values, in_degrees=True
    )


def fitted_markers(skeleton: Skeleton, motion: Motion) -> Recording:
    """Return where the fitted body carries its markers.

    Parameters
    ----------
    skeleton : Skeleton
    motion : Motion
        A motion of that skeleton.

    Returns
    -------
    Recording
        NaN while a marker's segment is out of sight, and for clusters with a free turn,
        whose angle is not part of a motion.
    """
    markers = skeleton.markers_in_world(motion.q)
    seen = dict(zip(motion.segments, motion.seen.T, strict=True))
    for column, marker in enumerate(skeleton.marker_set.markers):
        if marker.free_turn:
            markers[:, column] = np.nan
        elif marker.link in seen:
            markers[~seen[marker.link], column] = np.nan
    return Recording(
        motion.time, markers, skeleton.marker_set.labels, "the fitted markers"
    )


def _rotations(quaternions: Array) -> Array:
    """Return rotations about x, y and z of quaternions (T, 4), deg, without jumps."""
    from scipy.spatial.transform import Rotation  # takes a while to load

    angles = np.full((len(quaternions), 3), np.nan)
    known = np.isfinite(quaternions).all(axis=1)
    if known.any():
        turned = Rotation.from_quat(quaternions[known]).as_matrix()
        angles[known] = np.degrees(xyz_angles(turned))
    return angles
