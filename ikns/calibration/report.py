"""The report of a calibration: text and numbers, ready for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ikns.arrays import Mask
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.joint_axes import TILTS
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.exploration_fit import BodyReport
from ikns.calibration.judge.subjects import subject_names
from ikns.calibration.scaling import ScalingReport
from ikns.motion.marker_ik.rejection import count_rejections
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.recording import Recording


def static_report(
    static: Recording | None, scaling: ScalingReport, worn: MarkerSet
) -> dict[str, Any]:
    """Results of the static trial; without one, what is assumed of the body."""
    return {
        "source": None if static is None else static.source,
        "subjects": [] if static is None else subject_names(static, worn),
        "duration_s": scaling.duration,
        "converged": bool(scaling.converged),
        "lengths_m": scaling.lengths,
        "length_sd_m": scaling.length_sd,
        "residuals_m": scaling.residuals,
        "offsets_m": scaling.offsets,
        "unused": list(scaling.unused),
        "dropped": list(scaling.dropped),
        "held": list(scaling.held),
    }


def body_report(fitted: BodyReport | None) -> dict[str, Any] | None:
    """Results of the static trial and the explorations together; None without them."""
    if fitted is None:
        return None
    return {
        "lengths_m": fitted.lengths,
        "length_sd_m": fitted.length_sd,
        "tilts_rad": {name: tilt for name, (tilt, _) in fitted.tilts.items()},
        "tilt_sd_rad": {name: sd for name, (_, sd) in fitted.tilts.items()},
        # Those of which the explorations say more than that people differ.
        "tilts_shown": [
            f"{joint}_{'xyz'[component]}"
            for joint, component, spread in TILTS
            if fitted.tilts[f"{joint}_{'xyz'[component]}"][1] < spread / 2
        ],
        "camera_sd_m": fitted.camera_sd,
        "skin_sd_m": fitted.skin_sd,
        "frames": fitted.frames,
    }


def exploration_report(
    recording: Recording, motion: Motion, gate: Mask, chain: ChainLike
) -> dict[str, Any]:
    """How well a recording was tracked and how much of it is still."""
    residual = motion.residual[np.isfinite(motion.residual)]
    rejections = count_rejections(motion, chain)
    return {
        "source": recording.source,
        "duration_s": len(motion.time) / recording.rate,
        "frames": len(motion.time),
        "frames_converged": int(motion.converged.sum()),
        "frames_rejected": sum(rejections.values()),
        "rejections": rejections,
        "still_samples": int(gate.sum()),
        "still_s": float(gate.sum() / recording.rate),
        "residual_median_m": float(np.median(residual)) if residual.size else None,
    }


def points_report(learned: NullSpaceMap, *, rate: float) -> list[dict[str, Any]]:
    """All PCA points, including those left out; `point` is the number in the map."""
    rows: list[dict[str, Any]] = []
    for center, count in zip(learned.all_centers_, learned.all_counts_, strict=True):
        row: dict[str, Any] = {
            "point": None,
            "center_m": center.tolist(),
            "samples": int(count),
            "still_s": float(count / rate),
        }
        used = np.flatnonzero((learned.centers_ == center).all(axis=1))
        if used.size:
            k = int(used[0])
            n = int(learned.n_components_[k])
            ratios = learned.explained_variance_ratio_[k]
            row |= {
                "point": k + 1,
                "components": n,
                "explained_variance": float(ratios[:n].sum()),
                "range_rad": (learned.upper_[k] - learned.lower_[k]).tolist(),
            }
        rows.append(row)
    return rows


def extrinsic_report(
    skeleton: Skeleton, pairs: Sequence[tuple[Motion, Mask]], chain: ChainLike
) -> dict[str, Any]:
    """Motion of thorax and joints outside the chain while the hand was still.

    Range from the 5th to the 95th percentile, in the exploration where it is largest;
    None for a joint that was never seen meanwhile.
    """
    span = np.full(skeleton.nv, np.nan)
    for motion, gate in pairs:
        if gate.any():
            poses = motion.q[gate]
            moved = np.stack([skeleton.difference(poses[0], pose) for pose in poses])
            moved[:, 6:][~motion.known[gate]] = np.nan
            seen = np.isfinite(moved).any(axis=0)
            low, high = np.nanpercentile(moved[:, seen], [5, 95], axis=0)
            span[seen] = np.fmax(span[seen], high - low)
    own = chain_joints(chain)
    widths = [None if np.isnan(width) else float(width) for width in np.degrees(span)]
    angles = zip(skeleton.joint_names, widths[6:], strict=True)
    return {
        "thorax_translation_m": float(np.linalg.norm(span[:3])),
        "thorax_rotation_deg": float(np.degrees(np.linalg.norm(span[3:6]))),
        "joints_deg": {joint: angle for joint, angle in angles if joint not in own},
    }
