"""Findings on single markers over time, with or without a body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Mask
from ikns.calibration.judge.finding import Finding, Severity, say_frames, say_markers
from ikns.calibration.judge.jumps import find_jumps
from ikns.calibration.judge.traces import frozen, stand_ins

#: From this share of the frames on, a recording is not used rather than cut.
_MOST_SPOILED = 0.5


def judge_traces(
    where: str, labels: Sequence[str], time: Array, markers: Array
) -> tuple[list[Finding], Mask, Array]:
    """Judge the traces of markers (T, M, 3) m, NaN where not seen.

    Returns
    -------
    findings : list of Finding
    spoiled : (T,) boolean array
        Frames in which a marker is known to be wrong.
    measured : (T, M, 3) array
        The markers without what no camera measured, NaN there.
    """
    findings: list[Finding] = []
    bad = stand_ins(markers)
    if bad.any():
        column = int(bad.sum(axis=0).argmax())
        numbers = 1000 * markers[bad[:, column], column][0]
        own = [labels[i] for i in np.flatnonzero(bad.any(axis=0)).tolist()]
        findings.append(
            Finding(
                "not seen",
                "refuse",
                where,
                f"{say_markers(own)} at {' '.join(f'{x:.0f}' for x in numbers)} mm "
                "where nobody is",
                "export what was not seen as empty cells",
                tuple(own),
                say_frames(np.asarray(bad.any(axis=1))),
            )
        )
        markers = np.where(bad[..., None], np.nan, markers)
    still = frozen(time, markers)
    for column in np.flatnonzero(still.any(axis=0)).tolist():
        findings.append(
            Finding(
                "frozen",
                _severity(still[:, column]),
                where,
                f"{labels[column]} stands still to the last digit while markers next "
                "to it move",
                "export gaps unfilled",
                (labels[column],),
                say_frames(still[:, column]),
            )
        )
    jumps = find_jumps(time, markers)
    spoiled: Mask = np.asarray((bad | still).any(axis=1))
    for (a, b), frames in jumps.exchanged.items():
        spoiled = spoiled | frames
        findings.append(
            Finding(
                "exchanged",
                _severity(frames),
                where,
                f"{labels[a]} and {labels[b]} carry each other's name",
                f"exchange {labels[a]} and {labels[b]} there",
                (labels[a], labels[b]),
                say_frames(frames),
            )
        )
    for marker, frames in jumps.astray.items():
        spoiled = spoiled | frames
        findings.append(
            Finding(
                "ghost",
                _severity(frames),
                where,
                f"{labels[marker]} jumps to another place and back"
                if not frames[[0, -1]].any()
                else f"{labels[marker]} jumps to another place",
                f"delete {labels[marker]} there, or give it its own trajectory",
                (labels[marker],),
                say_frames(frames),
            )
        )
    return findings, spoiled, markers


def _severity(frames: Mask) -> Severity:
    return "refuse" if frames.mean() >= _MOST_SPOILED else "warn"
