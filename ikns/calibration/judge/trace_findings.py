"""Findings on single markers over time, with or without a body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Mask
from ikns.calibration.judge.finding import Finding, Severity, say_frames, say_markers
from ikns.calibration.judge.jumps import find_jumps
from ikns.calibration.judge.quality import judge_quality
from ikns.calibration.judge.traces import frozen, stand_ins, straight

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
    bad = stand_ins(markers)
    findings = _not_seen(where, labels, markers, bad)
    markers = np.where(bad[..., None], np.nan, markers)
    findings += judge_quality(where, labels, time, markers)
    still, filled = frozen(time, markers), straight(time, markers)
    findings += [
        _made(where, labels[column], found[:, column], kind)
        for found, kind in ((still, "frozen"), (filled, "filled"))
        for column in np.flatnonzero(found.any(axis=0)).tolist()
    ]
    made = still | filled
    # What no camera measured jumps when it begins and ends.
    jumps = find_jumps(time, np.where(made[..., None], np.nan, markers))
    if jumps.together:
        findings.append(_joined(where, time, jumps.together))
    exchanged, astray = jumps.exchanged.items(), jumps.astray.items()
    findings += [_exchanged(where, [labels[i] for i in o], f) for o, f in exchanged]
    findings += [_ghost(where, labels[marker], frames) for marker, frames in astray]
    spoiled: Mask = np.asarray((bad | made).any(axis=1))
    for _, frames in (*exchanged, *astray):
        spoiled = spoiled | frames
    return findings, spoiled, markers


def _not_seen(
    where: str, labels: Sequence[str], markers: Array, bad: Mask
) -> list[Finding]:
    """Say which numbers stand for "not seen"."""
    if not bad.any():
        return []
    column = int(bad.sum(axis=0).argmax())
    numbers = 1000 * markers[bad[:, column], column][0]
    own = [labels[i] for i in np.flatnonzero(bad.any(axis=0)).tolist()]
    return [
        Finding(
            "not seen",
            "refuse",
            where,
            f"{say_markers(own)} at {' '.join(f'{x:.0f}' for x in numbers)} mm where "
            "no one can be",
            "export unseen markers as empty cells",
            tuple(own),
            say_frames(np.asarray(bad.any(axis=1))),
        )
    ]


#: What a marker does that a program made, by kind.
_MADE = {
    "frozen": "is identical in every digit while markers next to it move",
    "filled": "moves in a straight line at constant speed, as a filled gap does",
}


def _made(where: str, label: str, frames: Mask, kind: str) -> Finding:
    return Finding(
        kind,
        _severity(frames),
        where,
        f"{label} {_MADE[kind]}",
        "export gaps unfilled",
        (label,),
        say_frames(frames),
    )


def _exchanged(where: str, names: list[str], frames: Mask) -> Finding:
    own = say_markers(names)
    return Finding(
        "exchanged",
        _severity(frames),
        where,
        f"{own} have swapped names",
        f"swap {own} there" if len(names) == 2 else f"give {own} their own names there",
        tuple(names),
        say_frames(frames),
    )


def _ghost(where: str, label: str, frames: Mask) -> Finding:
    back = " and back" * (not frames[[0, -1]].any())
    return Finding(
        "ghost",
        _severity(frames),
        where,
        f"{label} jumps to another place{back}",
        f"delete {label} there, or give it its own trajectory",
        (label,),
        say_frames(frames),
    )


def _joined(where: str, time: Array, first: list[int]) -> Finding:
    """Say that all markers jump at once, to these frames."""
    part = np.zeros(len(time), dtype=bool)
    part[first] = True
    return Finding(
        "joined",
        "warn",
        where,
        "all markers jump at once (two recordings joined, or cameras moved)",
        f"use each part by itself, for example with --from {time[first[0]]:g}",
        (),
        say_frames(part),
    )


def _severity(frames: Mask) -> Severity:
    return "refuse" if frames.mean() >= _MOST_SPOILED else "warn"
