"""A calibration against the truth of a simulation: c and the true elbow swivel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.nullspace.map import still_mask

__all__ = ["SwivelSamples", "swivel_samples"]


class SwivelSamples(NamedTuple):
    """The still samples that a map was learned from, with the true swivel."""

    hand: Array  # (N, 3) m in the thorax frame
    labels: Indices  # (N,) PCA point, -1 for none
    c: Array  # (N,) control signal, not clipped
    swivel: Array  # (N,) true elbow swivel, rad
    correlations: list[float]  # of c and swivel at each of P points


def swivel_samples(subject: Subject, swivel: ArrayLike) -> SwivelSamples:
    """Compare c with the true swivel on the still samples of a calibration.

    The subject was just calibrated from one exploration of T frames, with one degree of
    freedom; the true swivel (T,) of each is in rad, NaN where it has none.
    """
    true = np.asarray(swivel, dtype=np.float64)
    if len(subject.motions) != 1 or true.shape != subject.motions[0].time.shape:
        raise InvalidInput(
            f"expected a subject with one exploration of {true.size} frames, found "
            f"{[len(motion.time) for motion in subject.motions]}."
        )
    motion, learned = subject.motions[0], subject.null_space_map
    still = still_mask(motion, subject.chain)
    hand, true = motion.task_position(subject.chain)[still], true[still]
    c = learned.control_signal(motion.chain_angles(subject.chain)[still], hand)
    correlations = []
    for k in range(len(learned.centers_)):
        own = (learned.labels_ == k) & np.isfinite(true) & np.isfinite(c)
        correlations.append(float(np.corrcoef(c[own], true[own])[0, 1]))
    return SwivelSamples(hand, learned.labels_, c, true, correlations)
