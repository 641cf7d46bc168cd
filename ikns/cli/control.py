"""``ikns control``: the control signal of a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import ikns
from ikns.cli.options import AsJson, Force, RecordingFile, SubjectFolder
from ikns.cli.output import (
    finite_median,
    progress,
    refuse_overwriting,
    show,
    table,
    write_csv,
)

__all__ = ["control", "write_control"]


def control(
    recording: RecordingFile,
    subject: SubjectFolder,
    out: Annotated[Path, typer.Option(help="CSV file to write.")] = Path("control.csv"),
    mode: Annotated[
        Literal["position", "rate"],
        typer.Option(
            help="c from the posture, as in the paper, or from null-space motion."
        ),
    ] = "position",
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write the control signal of a recording: c from 0 to 1, frame by frame.

    It is the map's own; `ikns run --source replay:FILE` also smooths it and leaves out
    frames that do not count.
    """
    refuse_overwriting(out, force=force)
    calibrated = ikns.Subject.load(subject)
    frames = ikns.read(recording)
    with progress() as report:
        motion = ikns.MarkerIK(calibrated.skeleton).track(
            frames, chain=calibrated.chain, progress=partial(report, recording.name)
        )
    result = write_control(out, calibrated, motion, mode=mode)
    show(
        {"recording": recording, "csv": out} | result,
        table(
            str(recording),
            {"quantity": "s", "value": "g"},
            [
                ["frames", result["frames"]],
                ["of these without a signal", result["frames_without_signal"]],
                ["% with the hand in the volume", _percent(result["inside_share"])],
                ["% with c cut off at 0 or 1", _percent(result["clipped_share"])],
                ["median of c", round(result["c_median"], 3)],
                [
                    "median marker residual, mm",
                    round(1000 * result["residual_median_m"], 1),
                ],
            ],
        ),
        f"Wrote {out}",
        as_json=as_json,
    )


def write_control(
    path: Path, subject: ikns.Subject, motion: ikns.Motion, *, mode: str = "position"
) -> dict[str, Any]:
    """Write ``control.csv`` and return what it holds in short.

    The columns are time_s; c, clipped to 0 to 1 (c_1, c_2, ... for several degrees of
    freedom), empty while the chain is not in sight; hand_speed_m_s in the thorax frame;
    inside (1 within the volume of the PCA points); residual_m of the markers. In rate
    mode c is held out of sight, empty only before the arm was first seen, and counts
    as cut off while it is at 0 or 1.
    """
    import numpy as np

    from ikns.live.control import RateControl

    learned, chain = subject.null_space_map, subject.chain
    place = motion.task_position(chain)
    if mode == "rate":
        raw = RateControl(learned, subject.skeleton, chain).track(motion)
    else:
        raw = learned.control_signal(motion.chain_angles(chain), place)
    raw = raw.reshape(len(place), -1)
    c = np.clip(raw, 0.0, 1.0)
    inside = learned.inside(place)
    names = ["c"] if c.shape[1] == 1 else [f"c_{k + 1}" for k in range(c.shape[1])]
    write_csv(
        path,
        ["time_s", *names, "hand_speed_m_s", "inside", "residual_m"],
        np.column_stack(
            [motion.time, c, motion.hand_speed(chain), inside, motion.residual]
        ),
    )
    known = np.isfinite(raw).all(axis=1)
    cut = (raw <= 0) | (raw >= 1) if mode == "rate" else (raw < 0) | (raw > 1)
    beyond = cut.any(axis=1)
    return {
        "frames": len(c),
        "frames_without_signal": int((~known).sum()),
        "inside_share": float((inside & known).sum() / max(known.sum(), 1)),
        "c_median": finite_median(c[:, 0]),
        "clipped_share": float(beyond.sum() / max(known.sum(), 1)),
        "residual_median_m": finite_median(motion.residual),
    }


def _percent(share: float) -> float:
    return round(100 * share, 1)
