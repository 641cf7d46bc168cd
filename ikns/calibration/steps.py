"""The steps of a calibration in order, and what each costs.

A cost is CPU seconds on the machine of ``benchmarks/README.md``; only their proportions
matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ikns.recording.recording import Recording

#: Names of steps; marker inverse kinematics has the file name of its recording.
SCALING, JUDGING, FITTING = "scaling", "judging", "fitting the body"
LEARNING, METHODS = "learning the map", "learning other methods"
#: Costs of steps that hardly depend on the recordings, and by frame of the others,
#: measured with 9000 frames of a simulated person (24 markers, `ikns calibrate`).
_FIXED = {SCALING: 0.25, FITTING: 0.27, LEARNING: 0.05, METHODS: 0.1}
_JUDGED, _TRACKED, _LEARNED, _READ_OUT = 1.6e-5, 2.7e-5, 1e-5, 3.5e-5

#: Name and cost.
Steps = list[tuple[str, float]]


def silent(step: str, done: int, total: int) -> None:
    """Report nothing."""


def calibration_steps(
    static: Recording | None,
    explorations: Sequence[Recording],
    natural: Sequence[Recording] = (),
) -> Steps:
    """Return the steps of :func:`ikns.calibrate` for these recordings.

    Examples
    --------
    >>> recording = Recording([0.0, 0.01], [[[0.1, 0.2, 0.3]]] * 2, ["C7"], "a/x.c3d")
    >>> [name for name, _ in calibration_steps(None, [recording])]
    ['scaling', 'judging', 'x.c3d', 'learning the map', 'learning other methods']
    """
    frames = sum(len(recording.time) for recording in explorations)
    body = body_steps(static, (*explorations, *natural))
    return [
        *body,
        (LEARNING, _FIXED[LEARNING] + _LEARNED * frames),
        (METHODS, _FIXED[METHODS] + _READ_OUT * frames),
    ]


def body_steps(static: Recording | None, recordings: Sequence[Recording]) -> Steps:
    """Return those of the body alone, all that new places of markers need."""
    tracked = tracking_steps(recordings)
    fitted = [(FITTING, _FIXED[FITTING]), *tracked]
    frames = sum(len(recording.time) for recording in recordings)
    return [
        (SCALING, _FIXED[SCALING]),
        (JUDGING, _JUDGED * frames),
        *tracked,
        *(fitted if static is not None else []),
    ]


def tracking_steps(recordings: Sequence[Recording], *, judged: bool = False) -> Steps:
    """Return marker inverse kinematics, of recordings that may also be `judged`."""
    cost = _TRACKED + (_JUDGED if judged else 0.0)
    return [
        (Path(recording.source).name, cost * len(recording.time))
        for recording in recordings
    ]
