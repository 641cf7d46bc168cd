"""A motion as a table for a file, and its summary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.rejection import count_rejections
from ikns.motion.motion import Motion
from ikns.numerics.median import finite_median

_THORAX = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")


class MotionTable(NamedTuple):
    """Joint angles in degrees, the pose of the thorax and residuals, by frame.

    Columns are ``time_s``; ``<joint>_deg``; ``thorax_<part>``, m and a unit quaternion
    in the world; ``residual_m``; ``converged``, 0 or 1.
    """

    columns: list[str]
    rows: Array  # (T, columns); NaN where not seen, or markers were rejected
    range_deg: dict[str, tuple[float, float]]  # of every joint; NaN for one never seen
    summary: dict[str, Any]  # frames, residual (m), held joints; ready for JSON


def motion_table(motion: Motion) -> MotionTable:
    """Return a motion of a body with a thorax, of at least one frame, as a table."""
    degrees = np.degrees(motion.angles)
    columns = [
        "time_s",
        *(f"{joint}_deg" for joint in motion.joint_names),
        *(f"thorax_{part}" for part in _THORAX),
        "residual_m",
        "converged",
    ]
    rows = np.column_stack(
        [
            motion.time,
            degrees,
            motion.thorax_in_world,
            motion.residual,
            motion.converged,
        ]
    )
    # NaN only for a joint that no frame shows.
    lowest, highest = np.fmin.reduce(degrees), np.fmax.reduce(degrees)
    span = highest - lowest
    ends = zip(lowest.tolist(), highest.tolist(), strict=True)
    rejections = count_rejections(motion, "both_arms")
    summary = {
        "frames": len(motion.time),
        "frames_converged": int(motion.converged.sum()),
        "frames_without_markers": int(np.isnan(motion.residual).sum()),
        "frames_rejected": sum(rejections.values()),
        "rejections": rejections,
        "residual_median_m": finite_median(motion.residual),
        "held_joints": motion.held,
        "moved_deg": dict(zip(motion.joint_names, span.tolist(), strict=True)),
    }
    ranges = dict(zip(motion.joint_names, ends, strict=True))
    return MotionTable(columns, rows, ranges, summary)


def limits_passed(
    skeleton: Skeleton, range_deg: dict[str, tuple[float, float]]
) -> dict[str, float]:
    """Return the limit, deg, of each joint that goes beyond it by 0.1 deg or more.

    Of two limits that of the farther end; a joint never seen has none.
    """
    found = {}
    limits = zip(np.degrees(skeleton.lower), np.degrees(skeleton.upper), strict=True)
    for joint, (lower, upper) in zip(skeleton.joint_names, limits, strict=True):
        low, high = range_deg[joint]
        below, above = lower - low, high - upper
        if max(below, above) >= 0.1:
            found[joint] = round(float(upper if above >= below else lower), 1)
    return found
