"""``ikns control``: the control signal of a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from ikns.cli.picture import refuse_picture, write_picture
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.errors import naming
from ikns.output.file import refuse_overwriting, write_csv

if TYPE_CHECKING:
    from ikns.live.control.recorded import ControlTable


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
            "when markers that c needs are hidden, or where the learned range is "
            "small.",
            min=0.0,
            max=10.0,
        ),
    ] = 0.025,
    figure: Annotated[
        Path | None,
        typer.Option(help="Picture of c over time to write: .png, .svg or .pdf."),
    ] = None,
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
    inputs = [recording, subject]
    refuse_overwriting(out, force=force, inputs=inputs, endings=[".csv"])
    refuse_picture(figure, force=force, inputs=inputs)
    check_inputs([recording], subject)

    from ikns.calibration.judged_motion import judged_motion
    from ikns.calibration.simulated import is_simulated
    from ikns.live.control.recorded import (
        control_table,
        jump_sentence,
        uncertain_sentence,
    )

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
            report=calibrated.report,
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
    jumps = jump_sentence(method, result["jumps_outside"])
    why = uncertain_sentence(result, max_uncertainty)
    warned += [said for said in (jumps, why) if said]
    simulated = is_simulated(calibrated, subject, [recording])
    _draw(figure, found, simulated=simulated, force=force)
    show(
        {
            "recording": recording,
            "csv": out,
            "figure": figure,
            "simulated": simulated,
            "method": method,
            "methods": calibrated.methods,
            "warnings": warned,
        }
        | result,
        table(str(recording), {"quantity": "s", "value": "g"}, _rows(result)),
        _methods(method, calibrated),
        *notes(warned),
        f"Wrote {out}" + (f" and {figure}" if figure else ""),
        as_json=as_json,
    )


def _rows(result: dict[str, Any]) -> list[list[Any]]:
    """Return the quantities of a summary, for people."""
    return [
        ["frames", result["frames"]],
        ["of these without a signal", result["frames_without_signal"]],
        ["of these, markers rejected", result["frames_rejected"]],
        ["of these, c too uncertain", result["frames_uncertain"]],
        [
            f"of those with a signal, % with the hand {result['inside_means']}",
            _percent(result["inside_share"]),
        ],
        [
            "of those with a signal, % with c clipped to 0 or 1",
            _percent(result["clipped_share"]),
        ],
        ["median of c", round(result["c_median"], 3)],
        ["median standard deviation of c", round(result["uncertainty_median"], 4)],
        ["median marker residual, mm", round(1000 * result["residual_median_m"], 1)],
    ]


def _draw(
    path: Path | None, found: ControlTable, *, simulated: bool, force: bool
) -> None:
    """Draw c as the CSV file has it, with the hand's speed, if asked to."""
    if path is None:
        return
    import numpy as np

    from ikns.view.signals import control_figure

    at, rows = found.columns.index, found.rows
    c = rows[:, 1 : at("hand_speed_m_s")]
    drawn = control_figure(
        rows[:, 0],
        c,
        rows[:, at("hand_speed_m_s")],
        # Where the hand is unknown the lines are broken, which says it.
        (rows[:, at("inside")] > 0) | np.isnan(rows[:, at("hand_speed_m_s")]),
        taught=found.summary["inside_means"],
        simulated=simulated,
    )
    write_picture(path, drawn, force=force)


def _methods(method: str, calibrated: ikns.Subject) -> str:
    """Say which method read c, and which one the calibration recommends."""
    from ikns.calibration.method_summary import no_range_learned

    summary = calibrated.report.get("methods", {}).get("summary") or {}
    # None where reaches speak for no method.
    best = summary.get("recommended") or method
    if summary and no_range_learned(summary):
        best = method
    advice = "" if best == method else f"; its calibration recommends {best}"
    have = ", ".join(calibrated.methods)
    return f"c as {method} reads it; this subject has {have}{advice}."


def _percent(share: float) -> float:
    return round(100 * share, 1)
