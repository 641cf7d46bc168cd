"""``ikns control``: the control signal of a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

import ikns
from ikns.cli.options import (
    AsJson,
    Force,
    From,
    RecordingFile,
    SubjectFolder,
    To,
)
from ikns.cli.output import notes, progress, show, table
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.output.file import refuse_overwriting, write_csv


@reads_markers
def control(
    read: Read,
    recording: RecordingFile,
    subject: SubjectFolder,
    out: Annotated[Path, typer.Option(help="CSV file to write.")] = Path("control.csv"),
    mode: Annotated[
        Literal["position", "rate"],
        typer.Option(
            help="c from the posture, as in the paper, or from null-space motion."
        ),
    ] = "position",
    method: Annotated[
        Literal["paper", "proximal", "intent"],
        typer.Option(
            help="What reads c off the posture: the paper's map over joint angles, the "
            "upper arm and elbow alone, or the departure from the natural posture."
        ),
    ] = "paper",
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write the control signal of a recording: c from 0 to 1, frame by frame.

    This is the map's own signal; `ikns run --source replay:FILE` also smooths it. As
    there, frames whose markers cannot be right have none.
    """
    refuse_overwriting(out, force=force, inputs=[recording, subject])
    check_inputs([recording], subject)

    from ikns.live.control.recorded import control_table
    from ikns.motion.marker_ik.rejection import say_rejections
    from ikns.motion.unseen import warn_unseen

    calibrated = ikns.Subject.load(subject)
    frames = read(recording, start=from_, end=to)
    warn_unseen(calibrated.skeleton, frames, calibrated.chain)
    with progress() as report:
        motion = ikns.MarkerIK(calibrated.skeleton).track(
            frames, chain=calibrated.chain, progress=partial(report, recording.name)
        )
    found = control_table(calibrated, motion, mode=mode, method=method)
    write_csv(out, found.columns, found.rows, force=force)
    result = found.summary
    left_out = say_rejections(result["rejections"], result["frames"])
    show(
        {"recording": recording, "csv": out, "method": method} | result,
        table(
            str(recording),
            {"quantity": "s", "value": "g"},
            [
                ["frames", result["frames"]],
                ["of these without a signal", result["frames_without_signal"]],
                ["of these, markers rejected", result["frames_rejected"]],
                ["% with the hand in the volume", _percent(result["inside_share"])],
                ["% with c cut off at 0 or 1", _percent(result["clipped_share"])],
                ["median of c", round(result["c_median"], 3)],
                [
                    "median marker residual, mm",
                    round(1000 * result["residual_median_m"], 1),
                ],
            ],
        ),
        *notes([f"{recording}: {left_out}."] if left_out else []),
        f"Wrote {out}",
        as_json=as_json,
    )


def _percent(share: float) -> float:
    return round(100 * share, 1)
