"""The gate of frames: which markers can be believed, live and in a recording alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.marker_gate import THORAX, MarkerGate
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.visibility import segment_pairs


class GateLimits(NamedTuple):
    """What the markers of a valid frame do not exceed.

    Parameters
    ----------
    residual : float
        Root mean square distance between pose and markers, m.
    worst_residual : float
        Largest distance between pose and a marker of the chain, m. Seven people in
        daily activities had up to 59 mm (``benchmarks/stray_marker.py``), and others
        may have a third more.
    intermarker_error : float
        Largest change since calibration of the distance between two markers of a
        segment of the chain, m. Seven people had up to 16 mm within clusters, two
        others 24 mm between landmarks on the skin (same benchmark).
    """

    residual: float = 0.05
    worst_residual: float = 0.08
    intermarker_error: float = 0.04


def marker_gate(skeleton: Skeleton, limits: GateLimits | None = None) -> MarkerGate:
    """Arrange the markers of thorax and arms, and the limits, for the kernel."""
    worn = skeleton.marker_set.markers
    pair, apart = segment_pairs(skeleton, "both_arms")
    group = np.array([_group(m.link, m.weight, m.static_only) for m in worn])
    return MarkerGate(
        group=group.astype(np.int64),
        pair=pair,
        apart=apart,
        pair_group=group[pair[:, 0]].astype(np.int64),
        limits=np.array(limits or GateLimits(), dtype=np.float64),
    )


def _group(link: str, weight: float, static_only: bool) -> int:
    if static_only or not weight > 0:
        return -1
    if link.startswith("thorax"):
        return THORAX
    for k, side in enumerate(SIDES):
        if link.startswith(side):
            return 1 + k
    return -1
