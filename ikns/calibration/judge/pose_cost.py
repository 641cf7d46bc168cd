"""How badly a posture fits a body, from scratch, in standard deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.plausible import LIKELY_BEYOND
from ikns.motion.marker_ik import MarkerIK

#: The weight of a marker in inverse kinematics is 1 at this standard deviation, m; so
#: the joint limits stand to the markers as in tracking (30 deg beyond: 2.6 deviations).
_UNIT_SD = 0.01


class PoseCost:
    """Solve single frames on a body, each from scratch, and say what they cost.

    Parameters
    ----------
    body : Skeleton
    deviations : (M,) array
        Standard deviation of each marker's place, m.
    """

    def __init__(self, body: Skeleton, deviations: Array) -> None:
        worn = body.marker_set
        weighted = tuple(
            replace(marker, weight=float((_UNIT_SD / sd) ** 2), static_only=False)
            for marker, sd in zip(worn.markers, deviations, strict=True)
        )
        self._deviations = deviations
        self._body = body.with_markers(replace(worn, markers=weighted))
        self._solver = MarkerIK(self._body)

    def __call__(self, target: Array) -> float:
        """Squared standard deviations of markers (M, 3) m and of joint limits."""
        q = self._solver.solve(target).q
        off = np.linalg.norm(self._body.markers_in_world(q) - target, axis=1)
        angles = q[-len(self._body.joint_names) :]
        beyond = np.maximum(self._body.lower - angles, angles - self._body.upper)
        return float(
            np.nansum((off / self._deviations) ** 2)
            + np.sum((np.maximum(0.0, beyond) / LIKELY_BEYOND) ** 2)
        )
