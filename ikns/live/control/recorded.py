"""The control signal of a whole recording, as a table and its summary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.motion.marker_ik.rejection import count_rejections
from ikns.motion.motion import Motion
from ikns.nullspace.readout import Method
from ikns.numerics.median import finite_median


class ControlTable(NamedTuple):
    """The control signal of a recording by frame.

    Parameters
    ----------
    columns : list of str
        ``time_s``; ``c``, clipped to 0 to 1 (``c_1``, ``c_2``, ... for several degrees
        of freedom), NaN while the chain is not in sight or its markers are rejected;
        ``hand_speed_m_s`` in the thorax frame; ``inside``, 1 within the volume of the
        PCA points, or of intent where natural movement was taught; ``residual_m`` of
        the markers.
    rows : (T, len(columns)) array
    summary : dict
        Counts, shares and medians, ready for JSON.
    """

    columns: list[str]
    rows: NDArray[np.float64]
    summary: dict[str, Any]


def control_table(
    subject: Subject,
    motion: Motion,
    *,
    method: Method = "paper",
) -> ControlTable:
    """Compute the control signal of a recording.

    Parameters
    ----------
    subject : Subject
    motion : Motion
        Of that subject.
    method : {"paper", "proximal", "intent"}
        What reads c off the posture, see :mod:`ikns.nullspace.readout`.

    Raises
    ------
    InvalidInput
        When the subject was calibrated without the method.
    """
    chain = subject.chain
    readout = subject.readout(method)
    place = motion.task_position(chain)
    raw = readout.control_signal(subject.skeleton, motion)
    raw = raw.reshape(len(place), -1)
    c = np.clip(raw, 0.0, 1.0)
    inside = readout.inside(subject.skeleton, motion)
    names = ["c"] if c.shape[1] == 1 else [f"c_{k + 1}" for k in range(c.shape[1])]
    rows = np.column_stack(
        [motion.time, c, motion.hand_speed(chain), inside, motion.residual]
    )
    known = np.isfinite(raw).all(axis=1)
    clipped = (raw < 0) | (raw > 1)
    rejections = count_rejections(motion, chain)
    summary = {
        "frames": len(c),
        "frames_without_signal": int((~known).sum()),
        "frames_rejected": sum(rejections.values()),
        "rejections": rejections,
        "inside_share": float((inside & known).sum() / max(known.sum(), 1)),
        "c_median": finite_median(c[:, 0]),
        "clipped_share": float(clipped.any(axis=1).sum() / max(known.sum(), 1)),
        "residual_median_m": finite_median(motion.residual),
    }
    columns = ["time_s", *names, "hand_speed_m_s", "inside", "residual_m"]
    return ControlTable(columns, rows, summary)
