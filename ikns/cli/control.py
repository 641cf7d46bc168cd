"""``ikns control``: the control signal of a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import ikns
from ikns.cli.options import (
    AnyMethod,
    AsJson,
    Force,
    From,
    RecordingFile,
    SubjectFolder,
    To,
)
from ikns.cli.output import notes, progress, show, table
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.errors import naming
from ikns.output.file import refuse_overwriting, write_csv


@reads_markers
def control(
    read: Read,
    recording: RecordingFile,
    subject: SubjectFolder,
    out: Annotated[Path, typer.Option(help="CSV file to write.")] = Path("control.csv"),
    method: AnyMethod = "paper",
    max_uncertainty: Annotated[
        float,
        typer.Option(
            help="Leave c empty while its standard deviation is larger, as it is "
            "when markers that c needs are hidden.",
            min=0.0,
            max=10.0,
        ),
    ] = 0.025,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write the control signal of a recording: c from 0 to 1, frame by frame.

    This is the map's own signal; `ikns run --source replay:FILE` also smooths it. As
    there, frames whose markers cannot be right have none. A recording that must not be
    used is refused, as by `ikns check`.
    """
    refuse_overwriting(out, force=force, inputs=[recording, subject])
    check_inputs([recording], subject)

    from ikns.calibration.judged_motion import judged_motion
    from ikns.live.control.recorded import control_table

    calibrated = ikns.Subject.load(subject)
    with naming(str(subject)):
        calibrated.readout(method)  # before anything is tracked
    frames = read(recording, start=from_, end=to)
    with progress() as report:
        motion, warned = judged_motion(
            calibrated.skeleton,
            frames,
            chain=calibrated.chain,
            measured=calibrated.measured,
            progress=partial(report, recording.name),
        )
    found = control_table(
        calibrated,
        motion,
        recording=frames,
        method=method,
        max_uncertainty=max_uncertainty,
    )
    write_csv(out, found.columns, found.rows, force=force)
    result = found.summary
    show(
        {
            "recording": recording,
            "csv": out,
            "method": method,
            "methods": calibrated.methods,
            "warnings": warned,
        }
        | result,
        table(
            str(recording),
            {"quantity": "s", "value": "g"},
            [
                ["frames", result["frames"]],
                ["of these without a signal", result["frames_without_signal"]],
                ["of these, markers rejected", result["frames_rejected"]],
                ["of these, c too uncertain", result["frames_uncertain"]],
                ["% with the hand in the volume", _percent(result["inside_share"])],
                ["% with c clipped to 0 or 1", _percent(result["clipped_share"])],
                ["median of c", round(result["c_median"], 3)],
                [
                    "median standard deviation of c",
                    round(result["uncertainty_median"], 4),
                ],
                [
                    "median marker residual, mm",
                    round(1000 * result["residual_median_m"], 1),
                ],
            ],
        ),
        _methods(method, calibrated),
        *notes(warned),
        f"Wrote {out}",
        as_json=as_json,
    )


def _methods(method: str, calibrated: ikns.Subject) -> str:
    """Say which method read c, and which one the calibration recommends."""
    from ikns.calibration.method_summary import no_range_learned

    summary = calibrated.report.get("methods", {}).get("summary") or {}
    best = summary.get("recommended", method)
    if summary and no_range_learned(summary):
        best = method
    advice = "" if best == method else f"; its calibration recommends {best}"
    have = ", ".join(calibrated.methods)
    return f"c as {method} reads it; this subject has {have}{advice}."


def _percent(share: float) -> float:
    return round(100 * share, 1)
