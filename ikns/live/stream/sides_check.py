"""Refuse to replay a recording in which left and right are swapped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.judged_motion import known_findings
from ikns.calibration.subject import Subject
from ikns.errors import MarkerMismatch
from ikns.recording.recording import Recording


def check_sides(
    recording: Recording,
    labels: tuple[str, ...],
    markers: NDArray[np.float64],
    subject: Subject,
) -> None:
    """Refuse a recording whose left and right are swapped, or that is mirrored.

    Whatever else is wrong may be replayed: each frame is judged by itself, but one of
    them alone does not tell left from right.

    Parameters
    ----------
    recording : Recording
    labels : tuple of M str
        Of the markers.
    markers : (T, M, 3) array
        Its first frames, m in the world.
    subject : Subject

    Raises
    ------
    MarkerMismatch
        In the words of the judge.
    """
    if len(markers) < 2:
        return
    time = recording.time[: len(markers)]
    found = known_findings(
        subject.skeleton,
        Recording(time, markers, labels, recording.source),
        chain=subject.chain,
        measured=subject.measured,
    )
    for finding in found:
        # An exchange of single markers names them.
        both = finding.kind == "exchanged" and not finding.markers
        if both or finding.kind == "mirrored":
            raise MarkerMismatch(finding.sentence)
