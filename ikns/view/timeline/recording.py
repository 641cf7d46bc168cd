"""A recording as tracked, on Rerun's timeline."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.body.skeleton import Skeleton
from ikns.motion.motion import Motion
from ikns.nullspace.signal_names import signal_names
from ikns.recording.recording import Recording
from ikns.view.timeline.entries import frame_entries
from ikns.view.timeline.rerun import RerunLog


def log_recording(
    log: RerunLog,
    skeleton: Skeleton,
    motion: Motion,
    recording: Recording,
    c: ArrayLike,
) -> int:
    """Log every frame of a recording.

    Parameters
    ----------
    log : RerunLog
    skeleton : Skeleton
    motion : Motion
        The recording as tracked.
    recording : Recording
        Gives the markers.
    c : (T,) or (T, d) array
        Control signals.

    Returns
    -------
    int
        Number of frames.
    """
    worn = skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)
    signals = np.reshape(np.asarray(c, dtype=np.float64), (len(motion.time), -1))
    names = signal_names(signals.shape[1])
    for k, at in enumerate((motion.time - motion.time[0]).tolist()):
        numbers = {
            f"signal/{name}": float(value)
            for name, value in zip(names, signals[k], strict=True)
        }
        numbers["residual/rms_mm"] = 1e3 * float(motion.residual[k])
        log.frame(
            at, frame_entries(skeleton, worn.labels, markers[k], motion.q[k], numbers)
        )
    return len(motion.time)
