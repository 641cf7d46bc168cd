"""What a fit to a static trial had to assume, in standard deviations and degrees.

Whatever the labels, some pose, sizes and placement of markers fit a static trial to a
millimeter. What tells a person from a wrong recording is how unlikely these are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.calibration.size_fit import (
    MARKER_SD,
    SizeFit,
    size_covariance,
    size_factors,
)

#: Marker places of a person: an offset of more standard deviations is not chance (chi
#: with 3 degrees of freedom: 1 in 7000 markers); 2.5 is the most in nine people.
LIKELY_OFFSET = 4.5
#: From here on an exchange of names is tried; it must gain much to be believed.
SUSPECT_OFFSET = 3.0
#: A static posture is no stretch, so a joint may not be beyond its limit, rad; what is
#: left to the fit's own error and to flexible people.
LIKELY_BEYOND = np.radians(10.0)
#: Segment lengths of a person, standard deviations; ANSUR II's shortest and longest of
#: 6068 are 3.7 from the mean.
LIKELY_SIZE = 4.0


class Assumed(NamedTuple):
    """What a fit assumes."""

    offsets: Array  # (M,) of the markers from their places, m; NaN where never seen
    offsets_sd: Array  # (M,) the same in standard deviations
    beyond: Array  # (J,) of the joints beyond their limits, rad; 0 within
    sizes_sd: Array  # (S,) of the segments from the population's, signed
    residuals: Array  # (M,) of the markers from the fitted body, m
    cost: float  # all of it, squared standard deviations

    @property
    def likely(self) -> bool:
        """Whether a person can stand there like that."""
        return self._within(LIKELY_OFFSET)

    @property
    def suspect(self) -> bool:
        """Whether names may be exchanged."""
        return not self._within(SUSPECT_OFFSET)

    def _within(self, offset: float) -> bool:
        return bool(
            np.nanmax(self.offsets_sd, initial=0.0) <= offset
            and self.beyond.max() <= LIKELY_BEYOND
            and np.abs(self.sizes_sd).max() <= LIKELY_SIZE
        )


def assumed(reference: Skeleton, target: Array, fit: SizeFit) -> Assumed:
    """Say what a fit of :func:`ikns.calibration.size_fit.fit_sizes` assumes.

    Parameters
    ----------
    reference : Skeleton
        The body with the markers at their nominal places.
    target : (M, 3) array
        Mean marker positions, m; NaN where never seen.
    fit : SizeFit
    """
    worn = reference.marker_set
    sized = reference.resized(size_factors(fit.log_sizes))
    placement = np.array([marker.placement_sd for marker in worn.markers])
    moved = fit.positions - sized.marker_positions
    seen = np.isfinite(target).all(axis=1)
    moved[~seen] = np.nan
    placed = sized.with_markers(worn.at(fit.positions)).markers_in_world(fit.q)
    residuals = np.linalg.norm(placed - target, axis=1)
    angles = fit.q[-len(reference.joint_names) :]
    beyond = np.maximum(
        0.0, np.maximum(reference.lower - angles, angles - reference.upper)
    )
    covariance = size_covariance()
    offsets_sd = np.linalg.norm(moved / placement, axis=1)
    cost = (
        np.nansum(offsets_sd**2)
        + np.nansum((residuals / MARKER_SD) ** 2)
        + np.sum((beyond / LIKELY_BEYOND) ** 2)
        + fit.log_sizes @ np.linalg.solve(covariance, fit.log_sizes)
    )
    return Assumed(
        np.linalg.norm(moved, axis=1),
        offsets_sd,
        beyond,
        fit.log_sizes / np.sqrt(np.diag(covariance)),
        residuals,
        float(cost),
    )
