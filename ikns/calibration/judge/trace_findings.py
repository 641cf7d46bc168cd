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
    spoiled: Mask = np.asarray((bad | still).any(axis=1))
    # What no camera measured jumps when it begins and ends.
    jumps = find_jumps(time, np.where(still[..., None], np.nan, markers))
    if jumps.together:
        findings.append(_joined(where, time, jumps.together))
    for wrong, frames in jumps.exchanged.items():
        spoiled = spoiled | frames
        names = tuple(labels[i] for i in wrong)
        findings.append(
            Finding(
                "exchanged",
                _severity(frames),
                where,
                f"{say_markers(names)} carry each other's name{'s' * (len(wrong) > 2)}",
                f"exchange {say_markers(names)} there"
                if len(wrong) == 2
                else f"give {say_markers(names)} their own names there",
                names,
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


def _joined(where: str, time: Array, first: list[int]) -> Finding:
    """Say that all markers jump at once, to these frames."""
    part = np.zeros(len(time), dtype=bool)
    part[first] = True
    return Finding(
        "joined",
        "warn",
        where,
        "all markers jump at once: two recordings joined, or cameras that moved",
        f"take each part by itself, as with --from {time[first[0]]:g}",
        (),
        say_frames(part),
    )


def _severity(frames: Mask) -> Severity:
    return "refuse" if frames.mean() >= _MOST_SPOILED else "warn"
